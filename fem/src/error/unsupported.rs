//! Combinations of settings that are not supported.

/// Reason why a combination of settings is not supported. [`help`](Self::help) says how to fix it.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Unsupported {
    /// A problem without a schedule.
    #[error("the problem has no schedule of load steps")]
    NoSchedule,
    /// A plane of symmetry on a surface that is not a plane normal to an axis.
    #[error("the surface is not a plane normal to an axis, so it cannot be a plane of symmetry")]
    NotAPlane,
    /// The conditions do not prevent all rigid motions.
    #[error("the body can still move {motion} ({count} rigid motions are free)")]
    FreeMotions {
        /// One of the free motions.
        motion: &'static str,
        /// Number of free motions.
        count: usize,
    },
    /// Two conditions prescribe different values for a component of a common node.
    #[error(
        "two conditions prescribe different values of {component}, {first} and {second}, at their common node {node} (at {position_mm:?} mm)"
    )]
    Conflict {
        /// Number of the node.
        node: u32,
        /// Reference position of the node, mm.
        position_mm: [f64; 3],
        /// Component that has two values: a displacement component or the damage.
        component: &'static str,
        /// Value that the first condition prescribes.
        first: f64,
        /// Value that the second condition prescribes.
        second: f64,
    },
    /// A compression test in which the surface `top` is not above the surface `bottom`.
    #[error("surface 'top' is not above surface 'bottom' (the axis is z)")]
    TopBelowBottom,
    /// A compression test in which the surfaces `top` and `bottom` have common nodes.
    #[error(
        "surfaces 'bottom' and 'top' have common nodes, which cannot be fixed and moved at the same time"
    )]
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
    /// Sparse factorisation on a device; only multigrid runs on devices.
    #[error("the sparse factorisation does not run on a device")]
    FactorOnDevice,
    /// Sparse factorisation with several ranks; only multigrid supports several ranks.
    #[error("the sparse factorisation does not run on several ranks")]
    FactorOnRanks,
    /// Follower pressure on a device.
    #[error("pressure on a deformed surface does not run on a device")]
    FollowerOnDevice,
    /// Follower pressure with several ranks.
    #[error("pressure on a deformed surface does not run on several ranks")]
    FollowerOnRanks,
    /// Sensitivities with follower pressure.
    #[error("sensitivities with pressure on a deformed surface are not implemented")]
    SensitivitiesOfFollower,
    /// A device together with several ranks.
    #[error("a device cannot be used with several ranks")]
    DeviceOnRanks,
    /// Sensitivities with several ranks.
    #[error("derivatives of the force cannot be computed on several ranks")]
    SensitivitiesOnRanks,
    /// More ranks than elements.
    #[error("the mesh has fewer elements than ranks")]
    FewElements,
    /// Sensitivities with arc-length steps.
    #[error(
        "sensitivities are derivatives at a fixed displacement, and with arc-length steps the displacement depends on the parameters"
    )]
    SensitivitiesOfArcLength,
    /// Sensitivities with friction or drag.
    #[error("sensitivities with friction or drag of platens are not implemented")]
    SensitivitiesOfFriction,
    /// Two parameters of sensitivities with the same name.
    #[error("two parameters have the name '{0}'")]
    NameTwice(
        /// The name.
        String,
    ),
    /// A parameter of sensitivities with the wrong number of materials.
    #[error("the parameter has {materials} materials for {regions} regions")]
    ParameterRegions {
        /// Number of materials given for the smaller or the larger parameter value.
        materials: usize,
        /// Number of regions of the mesh.
        regions: usize,
    },
    /// A parameter of sensitivities that changes the kind of a material: its law, the number of state values of the law,
    /// or whether the material can break.
    #[error(
        "the materials of region '{0}' below and above the parameter value do not have the law of the problem's material, or only some of these materials can break"
    )]
    ParameterKind(
        /// Name of the region.
        String,
    ),
    /// The materials for the smaller and the larger value of a parameter do not enclose the
    /// material of the problem.
    #[error(
        "the values {below} (below) and {above} (above) of region '{region}' do not enclose the value {value} of the problem"
    )]
    ParameterSides {
        /// Name of the region.
        region: String,
        /// Value of the constant in the material for a smaller value of the parameter.
        below: f64,
        /// Value of the constant in the material for a larger value of the parameter.
        above: f64,
        /// Value of the constant in the material of the problem.
        value: f64,
    },
    /// An interface between a region and itself.
    #[error("an interface needs two different regions")]
    InterfaceOfOneRegion,
    /// Two interfaces between the same regions.
    #[error("two interfaces have the same two regions")]
    InterfaceTwice,
    /// An interface with a region that the mesh does not have.
    #[error("the mesh has no region '{name}'; its regions are {regions}")]
    NoSuchRegion {
        /// Name of the missing region.
        name: String,
        /// Names of the regions of the mesh.
        regions: String,
    },
    /// An interface between regions without a common surface.
    #[error("the two regions have no common surface in this mesh")]
    NoInterface,
    /// An interface between regions that cannot break.
    #[error(
        "neither of the two regions can break, so that no crack can form along their interface"
    )]
    InterfaceOfElasticRegions,
    /// A parameter of sensitivities that changes the regions or the width of an interface.
    #[error(
        "the interfaces below and above the parameter value do not have the regions and widths of the problem's interfaces"
    )]
    ParameterInterfaces,
    /// A mesh with mixtures of two phases that has one region only.
    #[error("a mixed element consists of two regions, but the mesh has only one region")]
    MixtureOfOne,
    /// A mixture of two phases with a law whose moduli cannot be homogenised.
    #[error("a mixed element needs homogenised moduli, which exist for Hencky's law only")]
    MixtureLaw,
    /// A mixture with an inelastic law for which the strain of the matrix does not follow from the strain of the
    /// mixture.
    #[error(
        "a mixed element with an inelastic material needs a matrix with a Prony series of the shear modulus only, viscous stresses that damage degrades, and elastic grains"
    )]
    MixtureInelastic,
    /// A mixed element with a strength.
    #[error(
        "a mixed element has only the mean stress of matrix and grain, but the strength of the matrix refers to the stress of the matrix"
    )]
    MixtureStrength,
    /// The crack density AT1 on quadratic elements whose damage terms are integrated at Gauss points.
    #[error("with Gauss points, AT1 damages the vertices of quadratic elements without any load")]
    At1AtGaussPoints,
    /// The spectral split of the energy of a law other than Hencky's.
    #[error("the energy of this law has no spectral split")]
    SpectralSplit,
    /// A mixture of two phases whose energy has a user-defined split.
    #[error("a user-defined split cannot divide the energy of a mixture")]
    UserSplitOfMixture,
    /// The hybrid damage model with a user-defined split.
    #[error("a hybrid model with a user-defined split is not implemented")]
    HybridUserSplit,
    /// A split of the energy that is selected for a law which defines its own split.
    #[error("this law itself defines which part of its energy damage degrades")]
    SplitOfOwnLaw,
    /// Plasticity of a law other than Hencky's.
    #[error("plasticity is implemented for Hencky's law only")]
    PlasticLaw,
    /// Viscoelasticity of a law whose energy is not a sum of a volumetric and an isochoric part.
    #[error(
        "viscoelasticity needs an elastic law that is a sum of a function of the volume and a function of the isochoric strain"
    )]
    ViscoelasticLaw,
    /// A split of the energy of a viscoelastic or plastic material that is not defined.
    #[error("this split of the energy is not defined for a viscoelastic or plastic material")]
    SplitOfInelasticLaw,
    /// A strength of a material that cannot break.
    #[error("a strength needs a toughness")]
    StrengthWithoutToughness,
    /// A strength of a viscoelastic, plastic or user-defined law with a state.
    #[error("a strength is implemented for elastic laws only")]
    StrengthOfInelasticLaw,
    /// A strength with settings of the phase field for which it is not defined.
    #[error(
        "a strength is implemented only for AT1 without a split, without a history and without a user-defined degradation"
    )]
    StrengthOfField,
    /// A regularisation length that is too large for a strength.
    #[error(
        "with length_mm = {length_mm}, AT1 alone is weaker than strength.tensile_mpa; the length must be below {largest_mm:.3e} mm, 3 E Gc/(8 tensile_mpa²)"
    )]
    StrengthLength {
        /// Regularisation length of the phase field, mm.
        length_mm: f64,
        /// Length at which AT1 has the tensile strength, mm.
        largest_mm: f64,
    },
    /// An interface of a region with a strength.
    #[error(
        "the regions of an interface have a strength, but strength is not implemented in the band of an interface"
    )]
    InterfaceOfStrength,
    /// A degradation function that does not decrease from 1 to 0.
    #[error(
        "the degradation function g does not decrease from 1 to 0: g(0) = {start}, g(1) = {end}"
    )]
    Degradation {
        /// Value g(0), without damage.
        start: f64,
        /// Value g(1), at full damage.
        end: f64,
    },
    /// A law with too many state values.
    #[error("the law has {state_len} state values per point; at most {most} are allowed")]
    StateValues {
        /// Number of state values per point that the law has.
        state_len: usize,
        /// Largest supported number of state values per point.
        most: usize,
    },
    /// A law whose moduli at zero strain are not positive.
    #[error(
        "the moduli of the law at zero strain, K = {bulk_mpa} MPa and μ = {shear_mpa} MPa, are not both positive"
    )]
    ModuliAtRest {
        /// Bulk modulus, MPa.
        bulk_mpa: f64,
        /// Shear modulus, MPa.
        shear_mpa: f64,
    },
    /// A law whose energy or stress is not zero at zero strain.
    #[error("the energy or the stress of the law at zero strain is not zero")]
    StressAtRest,
    /// A law whose energy changes if the principal strains are exchanged.
    #[error("the energy of the law changes when two principal strains are exchanged")]
    NotSymmetric,
    /// Arc-length steps with loads or platens.
    #[error(
        "arc-length steps need a load that consists of prescribed displacements; they cannot scale loads and moving platens"
    )]
    ArcLengthWithLoads,
    /// Arc-length steps in a problem without damage.
    #[error("arc-length steps control the crack energy, but no region can break")]
    ArcLengthWithoutDamage,
    /// Arc-length steps with a damage model that does not minimise an energy.
    #[error("arc-length steps need a damage model that follows from an energy")]
    ArcLengthWithoutEnergy,
    /// Arc-length steps with viscous damage.
    #[error("arc-length steps need rate-independent damage")]
    ArcLengthWithViscosity,
    /// Arc-length steps with a law that has a state.
    #[error(
        "arc-length steps have no duration, but the evolution of the state of a law may depend on the duration"
    )]
    ArcLengthWithState,
    /// A J-integral with a law that has a state.
    #[error("the stress of a law with a state does not follow from a stored energy alone")]
    EnergyReleaseWithState,
    /// A controller that requests an arc-length step although its `controls_crack_energy` is false.
    #[error(
        "the step controller requests a step of crack energy (arc-length step) without announcing such steps"
    )]
    UnannouncedRelease,
    /// A load program with a prescribed force and conditions without its platen, or the platen without the load program.
    #[error(
        "the load program prescribes a force, but the conditions do not contain its platen, or the opposite"
    )]
    ForceWithoutPlaten,
    /// Derivatives of a test with a prescribed force between unilateral platens; only sliding platens are supported.
    #[error("derivatives with a prescribed force need sliding platens")]
    SensitivitiesOfForceByContact,
    /// Sensitivities of a curve whose displacement is a result, such as the displacement of an extensometer or of a loaded
    /// surface.
    #[error(
        "sensitivities are derivatives at a fixed displacement, and the measured displacement is not prescribed"
    )]
    SensitivitiesOfMeasuredDisplacement,
    /// A reason given by a caller of the library, such as a job of an ensemble.
    #[error("{message}")]
    ByCaller {
        /// The reason.
        message: String,
        /// How to fix it.
        help: &'static str,
    },
}

impl Unsupported {
    /// Returns the remedy.
    pub fn help(&self) -> &'static str {
        match self {
            Self::NoSchedule => "set the duration and the steps with schedule(…)",
            Self::NotAPlane => "rotate the mesh, or split the surface into planes",
            Self::FreeMotions { .. } => "prescribe more components, or call remove_rigid_motions",
            Self::Conflict { .. } => {
                "prescribe equal values at the common nodes, or remove the component from one of the conditions"
            }
            Self::TopBelowBottom | Self::CommonNodesOfPlatens => "check the surface names",
            Self::NameOfSurface => "give the node set another name",
            Self::EmptyNodeSet => "select nodes by their reference position in mm",
            Self::GaugeOutside(_) => "give a reference position within the body, in mm",
            Self::FactorOnDevice => "use linear = \"multigrid\" or \"auto\", or no device",
            Self::FactorOnRanks => "use linear = \"multigrid\" or \"auto\", or one process",
            Self::FollowerOnDevice => "use no device, or a dead pressure",
            Self::FollowerOnRanks => "use one process, or a dead pressure",
            Self::SensitivitiesOfFollower => {
                "use a dead pressure, or compute finite differences of runs"
            }
            Self::DeviceOnRanks => "use no device, or one process",
            Self::SensitivitiesOnRanks => "use one process",
            Self::FewElements => "use fewer processes, or a finer mesh",
            Self::SensitivitiesOfArcLength => "use fixed or adaptive steps",
            Self::SensitivitiesOfFriction => {
                "use platens without friction and drag, or compute finite differences of runs"
            }
            Self::NameTwice(_) => "give each parameter a unique name",
            Self::ParameterRegions { .. } => {
                "give one material to each region, in the order of the regions"
            }
            Self::ParameterKind(_) => "vary only the constants of the materials",
            Self::ParameterSides { .. } => {
                "build the parameter from materials below and above the materials of the problem"
            }
            Self::InterfaceTwice => "keep one of the two interfaces",
            Self::InterfaceOfOneRegion => "name two regions that touch each other",
            Self::NoSuchRegion { .. } => "name two regions of the mesh",
            Self::NoInterface => {
                "leave the interface out, or name two regions that touch each other"
            }
            Self::InterfaceOfElasticRegions => {
                "give at least one of the regions a toughness, or leave the interface out"
            }
            Self::ParameterInterfaces => "vary only the toughnesses of the interfaces",
            Self::MixtureOfOne => {
                "give the mesh at least two regions: the matrix first, then the phases of grains"
            }
            Self::MixtureLaw => {
                "use law = \"hencky\" for all phases, or a mesh whose element faces follow the grain surfaces"
            }
            Self::MixtureStrength => {
                "use a mesh whose element faces follow the grain surfaces (grain_mode = \"conforming\")"
            }
            Self::MixtureInelastic => {
                "use a mesh whose element faces follow the grain surfaces (grain_mode = \"conforming\")"
            }
            Self::PlasticLaw => "use law = \"hencky\"",
            Self::ViscoelasticLaw => "use law = \"hencky\", \"mooney-rivlin\" or \"ogden\"",
            Self::StrengthWithoutToughness => "add toughness_n_per_mm, or leave out strength",
            Self::StrengthOfInelasticLaw => "leave out strength, or viscoelastic and plastic",
            Self::StrengthOfField => {
                "use model = \"at1\", split = \"none\" and irreversibility = \"active-set\" or \"none\""
            }
            Self::StrengthLength { .. } => {
                "use a smaller length_mm and finer elements, a lower tensile strength, or a larger toughness"
            }
            Self::InterfaceOfStrength => "leave out the interface, or the strength of its regions",
            Self::SplitOfInelasticLaw => {
                "use split = \"volumetric-deviatoric\" without hybrid, or split = \"none\""
            }
            Self::At1AtGaussPoints => {
                "use quadrature = \"vertex\", which \"auto\" selects, or linear elements"
            }
            Self::SpectralSplit => {
                "use law = \"hencky\", split = \"volumetric-deviatoric\" or \"none\", or omit the toughness"
            }
            Self::UserSplitOfMixture => {
                "use a built-in split of the phase field, or a mesh whose element faces follow the grain surfaces"
            }
            Self::HybridUserSplit => "use hybrid = false, or a built-in split of the phase field",
            Self::SplitOfOwnLaw => "use split = \"none\", or omit the toughness",
            Self::Degradation { .. } => {
                "use a function g with g(0) = 1, g(1) = 0 and a slope that is nowhere positive"
            }
            Self::StateValues { .. } => "reduce the number of terms of the law",
            Self::ModuliAtRest { .. } => "check the signs of the parameters of the law",
            Self::StressAtRest => {
                "subtract from the energy its value at zero strain, and the terms that are linear in the strains"
            }
            Self::NotSymmetric => {
                "define an isotropic energy, symmetric in the three principal strains"
            }
            Self::ArcLengthWithLoads => {
                "prescribe the displacement of the ends, or use adaptive steps"
            }
            Self::ArcLengthWithoutDamage => "use adaptive steps",
            Self::ArcLengthWithoutEnergy => {
                "use irreversibility = \"active-set\" or \"none\", and no hybrid split"
            }
            Self::ArcLengthWithState => "use fixed or adaptive steps",
            Self::EnergyReleaseWithState => {
                "use elastic laws, whose J-integral is path independent"
            }
            Self::ArcLengthWithViscosity => {
                "set viscosity_mpa_s = 0, or use adaptive steps: viscous damage does not snap back"
            }
            Self::UnannouncedRelease => {
                "return true from controls_crack_energy of the controller, or return Step::Advance"
            }
            Self::ForceWithoutPlaten => {
                "take schedule and conditions from the same CompressionTest::following"
            }
            Self::SensitivitiesOfForceByContact => {
                "use sliding platens, or do not request derivatives"
            }
            Self::SensitivitiesOfMeasuredDisplacement => {
                "measure a surface whose displacement along the measured direction is prescribed, or do not request derivatives"
            }
            Self::ByCaller { help, .. } => help,
        }
    }
}
