//! Combinations of settings that are not supported.

/// Reason why a combination of settings is not supported. [`help`](Self::help) says how to fix it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// A problem without a schedule.
    #[error("it has no schedule")]
    NoSchedule,
    /// A plane of symmetry on a surface that is not a plane normal to an axis.
    #[error("it is no plane normal to one of the axes and cannot be one of symmetry")]
    NotAPlane,
    /// The conditions leave rigid motions free.
    #[error("the body can still move {motion} ({count} rigid motions are free)")]
    FreeMotions {
        /// One of the free motions.
        motion: &'static str,
        /// Number of free motions.
        count: usize,
    },
    /// Two conditions prescribe different values for a component of a common node.
    #[error(
        "at their common node {node} (at {position_mm:?} mm) they prescribe {first} and {second} for {component}"
    )]
    Conflict {
        /// Number of the node.
        node: u32,
        /// Reference position of the node, mm.
        position_mm: [f64; 3],
        /// Component with two values: a displacement or the damage.
        component: &'static str,
        /// Value of the first condition.
        first: f64,
        /// Value of the second condition.
        second: f64,
    },
    /// A compression test whose upper surface is not above the lower surface.
    #[error("surface 'top' does not lie above 'bottom' (the axis is z)")]
    TopBelowBottom,
    /// A compression test whose surfaces have common nodes.
    #[error("surfaces 'bottom' and 'top' have nodes in common, which cannot stand still and move")]
    CommonNodesOfPlatens,
    /// A node set and a surface of the mesh have the same name.
    #[error("a surface of the mesh has the same name")]
    NameOfSurface,
    /// No node satisfies the selection of a node set.
    #[error("the selection contains no node")]
    EmptyNodeSet,
    /// A gauge point outside the body.
    #[error("the gauge point {0:?} mm lies outside the body")]
    GaugeOutside(
        /// Reference position, mm.
        [f64; 3],
    ),
    /// A sparse factor on a device.
    #[error("a sparse factor is computed by the processor only")]
    FactorOnDevice,
    /// A sparse factor with several ranks.
    #[error("a sparse factor is computed by one process")]
    FactorOnRanks,
    /// A device with several ranks.
    #[error("each rank would need its own device")]
    DeviceOnRanks,
    /// Sensitivities with several ranks.
    #[error("derivatives of the force are computed by one process")]
    SensitivitiesOnRanks,
    /// More ranks than elements.
    #[error("the mesh has fewer elements than ranks")]
    FewElements,
    /// Sensitivities with arc-length steps.
    #[error("with arc-length steps the displacement of a point depends on the parameters")]
    SensitivitiesOfArcLength,
    /// Sensitivities with friction or drag.
    #[error("friction and drag of platens are not differentiated")]
    SensitivitiesOfFriction,
    /// Two parameters of sensitivities with the same name.
    #[error("two parameters have the name '{0}'")]
    NameTwice(
        /// The name.
        String,
    ),
    /// A parameter of sensitivities with the wrong number of materials.
    #[error("{materials} materials for {regions} regions")]
    ParameterRegions {
        /// Number of materials on one side of the parameter.
        materials: usize,
        /// Number of regions of the mesh.
        regions: usize,
    },
    /// A parameter of sensitivities that changes the kind of a material.
    #[error("region '{0}' has another law on one side, or a toughness")]
    ParameterKind(
        /// Name of the region.
        String,
    ),
    /// The two sides of a parameter do not enclose the material of the problem.
    #[error("region '{region}' has {below} and {above} on its two sides, the problem {value}")]
    ParameterSides {
        /// Name of the region.
        region: String,
        /// Value below.
        below: f64,
        /// Value above.
        above: f64,
        /// Value of the problem.
        value: f64,
    },
    /// A mesh with mixtures that has one region only.
    #[error("a mixture consists of two regions, and the mesh has one")]
    MixtureOfOne,
    /// A mixture with a law whose moduli cannot be homogenised.
    #[error("only moduli of Hencky's law can be homogenised")]
    MixtureLaw,
    /// AT1 on quadratic elements with Gauss points.
    #[error("with Gauss points, AT1 damages the vertices of quadratic elements unloaded")]
    At1AtGaussPoints,
    /// A spectral split of a law other than Hencky's.
    #[error("the energy of this law has no spectral split")]
    SpectralSplit,
    /// A mixture with a split of the user's.
    #[error("a user-defined split does not divide the energy of a mixture")]
    UserSplitOfMixture,
    /// A hybrid model with a split of the user's.
    #[error("a hybrid model with a user-defined split is not implemented")]
    HybridUserSplit,
    /// A split for a law that has its own.
    #[error("this law states itself which part of its energy damage degrades")]
    SplitOfOwnLaw,
    /// A degradation function that does not decrease from 1 to 0.
    #[error("it does not decrease from 1 to 0: its ends are {start} and {end}")]
    Degradation {
        /// Value without damage.
        start: f64,
        /// Value at full damage.
        end: f64,
    },
    /// A law with too many state values.
    #[error("it has {state_len} state values, at most {most} are stored")]
    StateValues {
        /// Number of state values of the law.
        state_len: usize,
        /// Largest number of state values.
        most: usize,
    },
    /// A law whose moduli at rest are not positive.
    #[error(
        "its moduli at rest, K = {bulk_mpa} MPa and μ = {shear_mpa} MPa, are not both positive"
    )]
    ModuliAtRest {
        /// Bulk modulus, MPa.
        bulk_mpa: f64,
        /// Shear modulus, MPa.
        shear_mpa: f64,
    },
    /// A law with energy or stress at rest.
    #[error("its energy or its stress at rest is not zero")]
    StressAtRest,
    /// A law that depends on the order of the principal strains.
    #[error("its energy changes when the principal strains are exchanged")]
    NotSymmetric,
    /// Arc-length steps with loads or platens.
    #[error(
        "arc-length steps move prescribed displacements back and forth; loads and platens do not follow"
    )]
    ArcLengthWithLoads,
    /// Arc-length steps without damage.
    #[error("arc-length steps control the crack energy, and no region can break")]
    ArcLengthWithoutDamage,
    /// Arc-length steps with damage that has no energy.
    #[error("arc-length steps need damage that makes an energy stationary")]
    ArcLengthWithoutEnergy,
    /// Arc-length steps with viscous damage.
    #[error("arc-length steps need rate-independent damage")]
    ArcLengthWithViscosity,
    /// Arc-length steps with a law that has a state.
    #[error("arc-length steps have no duration, on which the state of a law may depend")]
    ArcLengthWithState,
    /// A controller that requests a step by crack energy without announcing it.
    #[error("it requests a step by crack energy without announcing it")]
    UnannouncedRelease,
    /// A reason that a caller of the library found, such as a job of an ensemble.
    #[error("{message}")]
    ByCaller {
        /// The reason.
        message: String,
        /// How to fix it.
        help: &'static str,
    },
}

impl Unsupported {
    /// Returns how to fix the problem.
    pub fn help(&self) -> &'static str {
        match self {
            Self::NoSchedule => "give the time and the steps by schedule(…)",
            Self::NotAPlane => "turn the mesh, or split the surface into planes",
            Self::FreeMotions { .. } => {
                "prescribe more components, or have the rigid motions removed (remove_rigid_motions)"
            }
            Self::Conflict { .. } => "prescribe the same there, or take the component out of one",
            Self::TopBelowBottom | Self::CommonNodesOfPlatens => "check the surface names",
            Self::NameOfSurface => "give the node set another name",
            Self::EmptyNodeSet => "select nodes by their reference position in mm",
            Self::GaugeOutside(_) => "give a reference position within the body, in mm",
            Self::FactorOnDevice => "take linear = \"multigrid\" or \"auto\", or no device",
            Self::FactorOnRanks => "take linear = \"multigrid\" or \"auto\", or one process",
            Self::DeviceOnRanks => "take no device, or one process",
            Self::SensitivitiesOnRanks => "take one process",
            Self::FewElements => "take fewer processes",
            Self::SensitivitiesOfArcLength => "take fixed or adaptive steps",
            Self::SensitivitiesOfFriction => "take platens without them, or differences of runs",
            Self::NameTwice(_) => "give each parameter its own name",
            Self::ParameterRegions { .. } => {
                "give one material to each region, in the order of the regions"
            }
            Self::ParameterKind(_) => "change a number of the materials only",
            Self::ParameterSides { .. } => {
                "build the parameter around the materials of the problem"
            }
            Self::MixtureOfOne => "name the matrix first, then the phases of grains",
            Self::MixtureLaw => {
                "take law = \"hencky\" for all phases, or a mesh that follows the grains"
            }
            Self::At1AtGaussPoints => {
                "take quadrature = \"vertex\", which \"auto\" selects, or linear elements"
            }
            Self::SpectralSplit => {
                "take law = \"hencky\", split = \"volumetric-deviatoric\" or \"none\", or leave the toughness out"
            }
            Self::UserSplitOfMixture => {
                "take a split of the phase field, or a mesh that follows the grains"
            }
            Self::HybridUserSplit => "take hybrid = false, or a split of the phase field",
            Self::SplitOfOwnLaw => "take split = \"none\", or leave the toughness out",
            Self::Degradation { .. } => {
                "write g with g(0) = 1, g(1) = 0 and a slope that is not positive"
            }
            Self::StateValues { .. } => "reduce the number of terms of the law",
            Self::ModuliAtRest { .. } => "check the signs of its parameters",
            Self::StressAtRest => "subtract the constant, and the term that makes rest stationary",
            Self::NotSymmetric => "write an isotropic energy, symmetric in the three strains",
            Self::ArcLengthWithLoads => {
                "prescribe the displacement of the ends, or take adaptive steps"
            }
            Self::ArcLengthWithoutDamage => "take adaptive steps",
            Self::ArcLengthWithoutEnergy => {
                "take irreversibility = \"active-set\" or \"none\", and no hybrid split"
            }
            Self::ArcLengthWithState => "take fixed or adaptive steps",
            Self::ArcLengthWithViscosity => {
                "set viscosity_mpa_s = 0, or take adaptive steps: viscous damage does not snap back"
            }
            Self::UnannouncedRelease => {
                "let its controls_crack_energy return true, or take Step::Advance"
            }
            Self::ByCaller { help, .. } => help,
        }
    }
}
