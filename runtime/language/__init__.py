"""Language that several nodes share: the language model, its prompts and grammars, word forms and synonyms."""
