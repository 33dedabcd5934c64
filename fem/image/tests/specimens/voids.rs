//! Tests of voids as regions of their own.

use fem_image::{Contrast, Segmentation, VOID, VoidTreatment};

use crate::scene::{AIR, GRAIN, MATRIX, Pillar, Scene, VOXEL_MM};

const SHAPE: [usize; 3] = [80; 3];

/// Pores in the matrix and at the wall, as bright and as dark grains need them.
#[test]
fn voids_are_regions_with_their_volumes() {
    let pillar = Pillar::amid(SHAPE, 32.0, 64.0);
    for (contrast, [matrix, grain]) in
        [(Contrast::Bright, [MATRIX, GRAIN]), (Contrast::Dark, [GRAIN, MATRIX])]
    {
        let mut scene = Scene::filled(SHAPE, AIR);
        scene.paint(|p| pillar.distance(p), matrix);
        let lower = Pillar { ends: [8.0, 44.0], ..pillar };
        scene.add_balls(&lower, 5.0, 0.15, grain);
        let grains = scene.volumes.len();
        for (centre, radius) in [([30.0, 40.0, 58.0], 7.0), ([52.0, 44.0, 60.0], 5.0)] {
            scene.add_ball(centre, radius, AIR);
        }
        let image = scene.image();
        let run = |voids| {
            let settings = Segmentation { contrast, voids, ..Segmentation::default() };
            settings.run(&image, &mut |_| {}).unwrap()
        };
        let (filled, found) = (run(VoidTreatment::Matrix), run(VoidTreatment::Removed));
        assert_eq!((filled.phases.len(), filled.regions.len()), (1, grains), "{contrast:?}");
        // the grains and their statistics do not change, and a void is no neighbour of a grain
        assert_eq!(found.regions[..grains], filled.regions[..]);
        assert_eq!(found.statistics, filled.statistics);
        assert_eq!(found.phases, ["grain", VOID]);
        assert!(found.phase_of[..grains].iter().all(|phase| *phase == 0));
        assert_eq!(found.phase_of[grains..], [1, 1], "{contrast:?}");
        for (region, truth) in found.regions[grains..].iter().zip(&scene.volumes[grains..]) {
            let ratio = region.volume_mm3 / VOXEL_MM.powi(3) / truth;
            println!("{contrast:?}: {ratio}");
            // blurred voxels at the surface of a void are brighter than air and do not count
            assert!((0.83..1.02).contains(&ratio), "{contrast:?}: {ratio}");
            let labelled = found.labels.values.iter().filter(|label| **label == region.id).count();
            assert_eq!(labelled, region.voxels);
        }
        let shares = found.labels.values.iter().zip(&found.solid.values);
        let mut of_voids = shares.filter(|(label, _)| **label as usize > grains);
        assert!(of_voids.all(|(_, share)| *share == 1.0));
    }
}
