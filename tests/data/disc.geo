// Circular footing: unit disc centred at the origin.
// 80 equal boundary edges; 944 triangles, 513 nodes.
SetFactory("OpenCASCADE");
n = 80;               // edges on the circle
h = 0.0923;          // size inside

Circle(1) = {0, 0, 0, 1};
Curve Loop(1) = {1};
Plane Surface(1) = {1};
Transfinite Curve {1} = n + 1;

Physical Curve("edge", 1) = {1};
Physical Surface("footing", 2) = {1};

// One size h inside; the boundary is divided as set above.
Mesh.MeshSizeMin = h;
Mesh.MeshSizeMax = h;
Mesh.MeshSizeFromPoints = 0;
Mesh.MeshSizeFromCurvature = 0;
Mesh.MeshSizeExtendFromBoundary = 0;
Mesh.Algorithm = 6; // Frontal-Delaunay
Mesh.RecombineAll = 0;
Mesh.ElementOrder = 1;
Mesh.Smoothing = 5;
Mesh.SaveAll = 0;
Mesh.Binary = 0;
Mesh.MshFileVersion = 4.1;
