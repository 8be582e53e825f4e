"""The fast multipole method for settlements under pressures on cells.

Black-box: the kernel is interpolated in Chebyshev points, so any radial influence function will do
(Fong and Darve, J. Comput. Phys. 228 (2009) 8712), on an adaptive quadtree (Carrier, Greengard and
Rokhlin, SIAM J. Sci. Stat. Comput. 9 (1988) 669). The particles are the loaded cells, with moments
of their own, and the field points. Who does what:

====  ================================================  ======================  ===============
step  from, to                                          matrices                product
====  ================================================  ======================  ===============
P2M   cells, multipole expansion of their box           moments                 `CellExpansions`
M2M   multipole expansions of children, of parent       `Chebyshev.m2m`         `Translation`
M2L   multipole, local expansion of boxes of one level  `Chebyshev.m2l`         `families`
L2L   local expansion of parent, of children            `Chebyshev.l2l`         `Translation`
L2P   local expansion of a leaf, its points             none                    `loops.l2p`
P2P   cells, points beside them                         exact entries           `NearEntries`
M2P   multipole expansion, points of a larger leaf      `assembly.m2p_blocks`   `SparseBlocks`
P2L   cells, local expansion of a box beside them       `assembly.p2l_blocks`   `SparseBlocks`
====  ================================================  ======================  ===============

`lists` has the lists of boxes that each step follows.
"""
