"""What a flat wall is to a wet bead.

A sphere on a plane is pulled by 4πγR (McFarlane and Tabor 1950), two equal spheres by 2πγR (Derjaguin 1934): as the
engine takes a wall for an equal sphere, every wall stands in a deck `WALL_COPIES` times, and each law at a wall is so
many times that of two equal spheres. For touching bridges this gives the lubrication forces of a sphere on a plane as
well; for open ones beyond the minimum separation half of the normal one, and decks add the other half.
"""

WALL_COPIES = 2
