//! Meshes and specimens, and their files.

mod fuzz;
mod gmsh;
mod import;
mod mesh;
mod meshing;
mod phases;
mod programs;
mod scanner;
mod specimen;
mod stl;
mod surfaces;
mod voxel_grains;
