//! Brazilian test: a disc is compressed across its diameter, and splits under the tension along the other diameter.

use std::ops::RangeInclusive;

use fem::TetMesh;
use nalgebra::Vector3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::conditions::{ConditionsCase, MeasureCase, Similarity};
use super::definition::{TestKind, TestSetting, WrongKey, prescribed};

/// Surfaces under the jaws, with the sign of x.
const JAWS: [(&str, f64); 2] = [("jaw-left", -1.0), ("jaw-right", 1.0)];
/// Accepted area of the faces under a jaw, in units of the area of the stated arc.
const COVERED: RangeInclusive<f64> = 0.5..=2.0;
/// Largest angle of contact. Jaws of the ISRM have about 10°, flattened discs about 20 to 30°.
const MOST_DEG: f64 = 90.0;

/// `test.kind.brazilian-disc`: a cylinder between two smooth rigid jaws, which touch its side at both ends of the diameter
/// along x. The jaw at positive x moves towards the other jaw.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BrazilianDisc {
    /// Central angle of the arc in degrees on which each jaw touches the disc.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 90))]
    pub contact_deg: f64,
}

impl TestKind for BrazilianDisc {
    fn name(&self) -> &'static str {
        "brazilian-disc"
    }

    fn in_words(&self) -> String {
        format!("compression of a disc across its diameter by jaws of {} degrees", self.contact_deg)
    }

    fn surfaces(&self) -> &'static [&'static str] {
        &["side"]
    }

    fn check(&self, _: &TestSetting) -> Result<(), WrongKey> {
        if self.contact_deg > 0.0 && self.contact_deg <= MOST_DEG {
            return Ok(());
        }
        Err(WrongKey {
            key: "test.kind.brazilian-disc.contact_deg".to_owned(),
            value: self.contact_deg.to_string(),
            problem: format!("must be above 0 and at most {MOST_DEG} degrees"),
            help: "It is the central angle of the arc that a jaw touches: 10 is usual.",
        })
    }

    fn conditions(&self, setting: &TestSetting) -> ConditionsCase {
        let [(left, _), (right, _)] = JAWS;
        let measure = MeasureCase { surface: right.to_owned(), direction: [-1.0, 0.0, 0.0] };
        ConditionsCase {
            prescribe: vec![
                prescribed(left, [Some(0.0), None, None]),
                prescribed(right, [Some(-setting.displacement_mm), None, None]),
            ],
            remove_rigid_motions: true,
            ..ConditionsCase::of_kind(measure, Similarity::Diametral)
        }
    }

    fn add_surfaces(&self, mesh: &mut TetMesh) -> Result<(), String> {
        let Some(side) = mesh.surfaces.get("side") else {
            return Err("the mesh has no surface \"side\" for the jaws".to_owned());
        };
        let ends = |axis: usize| {
            let all = || mesh.nodes.iter().map(|node| node[axis]);
            [all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max)]
        };
        let [[left, right], [front, back], [bottom, top]] = [0, 1, 2].map(ends);
        let [x, y] = [0.5 * (left + right), 0.5 * (front + back)];
        let half = 0.5 * self.contact_deg.to_radians();
        let centre = |face: &[u32; 3], axis: usize| {
            face.iter().map(|&node| mesh.nodes[node as usize][axis]).sum::<f64>() / 3.0
        };
        let jaws = JAWS.map(|(name, sign)| {
            let angle = |face: &[u32; 3]| (centre(face, 1) - y).atan2(sign * (centre(face, 0) - x));
            let touched = side.iter().filter(|face| angle(face).abs() <= half).copied();
            (name, touched.collect::<Vec<_>>())
        });
        let stated = (right - left) * half * (top - bottom);
        for (name, faces) in &jaws {
            let covered = faces.iter().map(|face| area(mesh, face)).sum::<f64>() / stated;
            if !COVERED.contains(&covered) {
                return Err(format!(
                    "the faces of the mesh under {name} cover {covered:.1} times the arc of \
                     test.kind.brazilian-disc.contact_deg = {}; reduce specimen.spacing_mm to a third of the arc, or \
                     increase contact_deg",
                    self.contact_deg
                ));
            }
        }
        // a face belongs to one surface
        let free = |face: &[u32; 3]| !jaws.iter().any(|(_, faces)| faces.contains(face));
        let side = side.iter().filter(|face| free(face)).copied().collect();
        mesh.surfaces.insert("side".to_owned(), side);
        mesh.surfaces.extend(jaws.map(|(name, faces)| (name.to_owned(), faces)));
        Ok(())
    }
}

/// Area of a face in mm².
fn area(mesh: &TetMesh, face: &[u32; 3]) -> f64 {
    let [a, b, c] = face.map(|node| Vector3::from(mesh.nodes[node as usize]));
    0.5 * (b - a).cross(&(c - a)).norm()
}
