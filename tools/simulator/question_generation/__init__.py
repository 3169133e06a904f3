"""How people ask for things in a house: words, places, relations and the questions that have one right answer."""
