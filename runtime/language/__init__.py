"""The local language model and the words that nodes share: prompts, grammars, word forms, synonyms."""
