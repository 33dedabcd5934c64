//! Properties that every device must have, tested with this machine as the device.

use std::sync::atomic::{AtomicUsize, Ordering};

use crate::test_device::test_device;
use fem::device::{
    Argument, Array, ComputeDevice, Device, DeviceError, Host, Kernel, Memory, Program,
};
use fem::{
    CompressionTest, CylinderLattice, Fracture, LinearScheme, Material, Order, PhaseField,
    Schedule, SolverOptions,
};

#[test]
fn a_kernel_runs_once_for_each_item() {
    let Some(device) = test_device() else { return };
    let parameters =
        [("double", "a"), ("index", "shift"), ("const double *", "x"), ("double *", "y")];
    let kernel = Kernel::new("axpy", &parameters, "    y[at] += a * x[at + shift];\n");
    let program = device.compile(&[kernel]).expect("it compiles");
    let n = 100_003;
    let x = Array::of(&device, &(0..n + 2).map(f64::from).collect::<Vec<_>>()).expect("memory");
    let mut y = Array::of(&device, &vec![1.0; n as usize]).expect("memory");
    let arguments = [Argument::Real(0.5), Argument::Index(2), x.argument(), y.argument()];
    program.launch(0, n as usize, &arguments).expect("it runs");
    let mut out = vec![0.0; n as usize];
    y.read(&mut out).expect("it is read");
    assert!((0..n).all(|i| out[i as usize] == 1.0 + 0.5 * f64::from(i + 2)));
    y.write(7, &[3.0]).expect("it is written");
    y.read(&mut out).expect("it is read");
    assert_eq!(out[6..9], [5.0, 3.0, 6.0]);
}

#[test]
fn the_error_of_a_kernel_that_is_not_c_contains_the_message_of_the_compiler() {
    let Some(device) = test_device() else { return };
    let kernel = Kernel::new("wrong", &[("double *", "y")], "    y[at] = nothing;\n");
    let error = device.compile(&[kernel]).expect_err("it is not declared");
    assert!(error.to_string().contains("nothing"), "{error}");
}

/// The host as a device with limited memory.
#[derive(Debug)]
struct Small {
    host: Host,
    left: AtomicUsize,
}

impl Device for Small {
    fn name(&self) -> String {
        "a small device".into()
    }

    fn compile(&self, text: &str, kernels: &[Kernel]) -> Result<Box<dyn Program>, DeviceError> {
        self.host.compile(text, kernels)
    }

    fn allocate(&self, bytes: usize) -> Result<Box<dyn Memory>, DeviceError> {
        let taken = |left: usize| left.checked_sub(bytes);
        match self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, taken) {
            Ok(_) => self.host.allocate(bytes),
            Err(_) => Err(DeviceError("no memory is left".into())),
        }
    }
}

#[test]
fn the_processor_continues_after_a_failure_of_the_device() {
    let Ok(host) = Host::new() else { return println!("SKIPPED: no C compiler") };
    drop(host);
    let run = |device: Option<ComputeDevice>| {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 };
        let matrix = Material::hencky(275.0, 0.25).with_fracture(Fracture {
            toughness_n_per_mm: 0.0025,
            viscosity_mpa_s: 0.3,
            residual_stiffness: 0.01,
        });
        let options = SolverOptions { linear: LinearScheme::Multigrid, ..SolverOptions::default() };
        let problem = CompressionTest::new(0.05, Schedule::fixed(1.0, 4))
            .builder(lattice.build().expect("a mesh"))
            .expect("a specimen")
            .order(Order::Quadratic)
            .materials([matrix])
            .phase_field(PhaseField::new(0.06))
            .options(options)
            .device(device)
            .build()
            .expect("valid input");
        let mut run = problem.start();
        while run.step().is_some() {}
        (run.machine(), run.finish().curve)
    };
    let (_, expected) = run(None);
    let highest = expected.iter().map(|p| p.force_n).fold(0.0, f64::max);
    // with the first four values, the memory is too small, and the device fails: at once, when it allocates the vectors
    // of the levels, when it stores the hierarchy, and during a solution; 100 MB are sufficient
    for megabytes in [0, 2, 4, 6, 100] {
        let left = AtomicUsize::new(megabytes << 20);
        let small = Small { host: Host::new().expect("as before"), left };
        let (machine, curve) = run(Some(ComputeDevice::with(small)));
        let whole = machine == "a small device";
        assert_eq!(whole, megabytes == 100, "{megabytes} MB: {machine}");
        assert!(
            whole
                || machine.ends_with("the device failed: no memory is left")
                || machine.ends_with("the device failed to compute residuals: no memory is left"),
            "{machine}"
        );
        assert_eq!(curve.len(), expected.len());
        for (a, b) in curve.iter().zip(&expected) {
            assert!((a.force_n - b.force_n).abs() < 1e-7 * highest, "{a:?} {b:?}");
        }
    }
}
