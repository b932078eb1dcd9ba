"""Forces of bonds, angles and dihedrals: laws of given tuples of particles."""
