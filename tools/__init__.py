"""Programs for those who work on grazemap: the picture of the house, and the record of the long checks."""
