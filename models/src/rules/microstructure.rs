//! Rule: runs on a single microstructure do not show the scatter between microstructures.

use surrogate::Dataset;

use super::rule::{Rule, Warning, qualified};
use crate::case::{Microstructure, SpecimenGeometry};
use crate::pipeline::inputs::Inputs;
use crate::report::Qualifier;
use crate::results_folder::error::WorkflowError;
use crate::runs::made_on::MadeOn;

/// Rule on the ensemble: its runs must use more than one microstructure.
pub(super) const RULE: Rule = Rule { reads: &["ensemble"], check };

/// Origin of the single microstructure of all runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// A generated packing, with `design.microstructure = "one"`.
    Packing,
    /// The only image of the case.
    Image,
    /// The first of several images, `design.microstructure = "one"`.
    FirstImage,
    /// The surfaces of the grains of one specimen.
    Surfaces,
    /// A mesh file with several regions.
    Mesh,
}

impl Source {
    /// Returns the origin of the microstructure; `None` for specimens that consist of matrix only.
    fn of(geometry: &SpecimenGeometry, asked: Microstructure) -> Option<Self> {
        match geometry {
            SpecimenGeometry::Cylinder { grains, .. } => grains.as_ref().map(|_| Self::Packing),
            SpecimenGeometry::Image { further, .. } => {
                let is_first = !further.is_empty() && asked == Microstructure::One;
                Some(if is_first { Self::FirstImage } else { Self::Image })
            }
            SpecimenGeometry::Surfaces { .. } => Some(Self::Surfaces),
            SpecimenGeometry::Mesh { regions, .. } => (regions.len() > 1).then_some(Self::Mesh),
            SpecimenGeometry::Absent | SpecimenGeometry::Block { .. } => None,
        }
    }

    fn words(self) -> [&'static str; 2] {
        match self {
            Self::Packing => [
                "All runs are on one packing (design.microstructure = \"one\")",
                "design.microstructure = \"per-run\" includes both",
            ],
            Self::Image => [
                "All runs are on one image",
                "images of further specimens in specimen.image.further_stacks include both",
            ],
            Self::FirstImage => [
                "All runs are on the first image: design.microstructure = \"one\" leaves those of \
                 specimen.image.further_stacks out",
                "design.microstructure = \"per-run\" includes both",
            ],
            Self::Surfaces => [
                "All runs are on the grains of one specimen (specimen.stl)",
                "[specimen] with grains and design.microstructure = \"per-run\", or with images of several specimens, \
                 includes both",
            ],
            Self::Mesh => [
                "All runs are on one mesh file",
                "[specimen] with grains and design.microstructure = \"per-run\", or with images of several specimens, \
                 includes both",
            ],
        }
    }
}

fn check(inputs: &Inputs<'_>) -> Result<Vec<Warning>, WorkflowError> {
    let runs = Dataset::read_csv(inputs.file("runs.csv")?)?;
    // read the case only if needed: reading a key registers a dependency
    if MadeOn::of(&runs) != MadeOn::One {
        return Ok(Vec::new());
    }
    let source = Source::of(&inputs.geometry()?, *inputs.microstructure());
    Ok(source.map_or_else(Vec::new, warned))
}

fn warned(source: Source) -> Vec<Warning> {
    let [what, mend] = source.words();
    let text = format!(
        "{what}, so that the scatter between microstructures is unknown. The intervals do not include this scatter, and \
         the calibrated values compensate the difference between this microstructure and the tested specimens: \
         {mend}."
    );
    qualified(Qualifier::OneMicrostructure, text)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::CaseFile;

    fn source(change: impl Fn(&str) -> String, asked: Microstructure) -> Option<Source> {
        let text = change(crate::case::Case::TEMPLATE);
        let file = CaseFile::parse(&text, std::path::Path::new("case.toml")).unwrap();
        Source::of(&file.geometry().unwrap(), asked)
    }

    #[test]
    fn one_packing_is_warned_of_and_plain_matrix_is_not() {
        assert_eq!(source(str::to_owned, Microstructure::One), Some(Source::Packing));
        let plain = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
                     [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
        assert_eq!(source(|_| plain.to_owned(), Microstructure::One), None);
    }

    #[test]
    fn what_is_left_out_and_how_to_include_it_is_said() {
        for (source, mend) in [
            (Source::Packing, "design.microstructure = \"per-run\" includes"),
            (Source::Image, "specimen.image.further_stacks include"),
            (Source::FirstImage, "design.microstructure = \"per-run\" includes"),
            (Source::Mesh, "images of several specimens"),
        ] {
            let warnings = warned(source);
            assert_eq!(warnings[0].qualifier, Some(Qualifier::OneMicrostructure));
            let text = &warnings[0].text;
            assert!(
                text.contains("the scatter between microstructures is unknown")
                    && text.contains(mend),
                "{text}"
            );
        }
    }
}
