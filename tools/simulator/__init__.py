"""The house: procedural multi-floor buildings with everything that is true about them, all from one seed."""
