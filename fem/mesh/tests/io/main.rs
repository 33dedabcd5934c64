//! Meshes and specimens, and their files.

mod fuzz;
mod gmsh;
mod mesh;
mod meshing;
mod phases;
mod scanner;
mod specimen;
mod stl;
mod voxel_grains;
