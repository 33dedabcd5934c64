//! Tests of meshes, specimens and their files.

mod builders;
mod decimation;
mod fuzz;
mod gmsh;
mod gmsh_variants;
mod import;
mod interface;
mod mesh;
mod meshing;
mod phases;
mod programs;
mod round_bar;
mod scanner;
mod separation;
mod specimen;
mod stl;
mod surface_import;
mod surfaces;
mod voxel_grains;
