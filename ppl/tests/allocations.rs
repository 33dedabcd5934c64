//! After its start the sampling loop allocates no memory.

use std::{
    alloc::{GlobalAlloc, Layout, System},
    cell::Cell,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use ppl::{LogDensity, Nuts, Rejection};

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

struct Counting;

// SAFETY: every call is forwarded unchanged to the system allocator
#[allow(unsafe_code, reason = "counting allocations takes a global allocator; tests only")]
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller keeps the contract of `alloc`
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: `pointer` came from `alloc` above with this layout
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static COUNTING: Counting = Counting;

fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

/// A normal density with correlated neighbours that counts allocations between its evaluations.
struct Watch {
    dim: usize,
    evaluations: AtomicU64,
    /// Number of allocations at the last evaluation.
    before: AtomicU64,
    /// Number of evaluations without an allocation before them, since the last allocation.
    quiet: AtomicU64,
}

impl LogDensity for Watch {
    type Workspace = ();

    fn dim(&self) -> usize {
        self.dim
    }

    fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
        let coupling: f64 = y.windows(2).map(|pair| pair[0] * pair[1]).sum();
        Ok(0.45 * coupling - 0.5 * y.iter().map(|y| y * y).sum::<f64>())
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
        let now = allocations();
        if self.before.swap(now, Relaxed) == now {
            self.quiet.fetch_add(1, Relaxed);
        } else {
            self.quiet.store(0, Relaxed);
        }
        self.evaluations.fetch_add(1, Relaxed);
        for i in 0..self.dim {
            let left = if i > 0 { y[i - 1] } else { 0.0 };
            let right = y.get(i + 1).copied().unwrap_or(0.0);
            g[i] = 0.45 * (left + right) - y[i];
        }
        self.log_density(y, w)
    }
}

/// With every kind of map, no allocation happens between two leapfrog steps after the warmup.
#[test]
fn no_leapfrog_allocates() {
    for (dim, nuts) in [(10, Nuts::stan_compatible()), (10, Nuts::default()), (60, Nuts::default())]
    {
        let zero = || AtomicU64::new(0);
        let watch = Watch { dim, evaluations: zero(), before: zero(), quiet: zero() };
        let nuts = nuts.chains(1).threads(1).warmup(200).draws(300).seed(1);
        let chain = nuts.run(&watch).expect("runs").chains.remove(0);
        assert!(chain.divergences.is_empty());
        let leapfrogs: u64 = chain.stats.iter().map(|s| u64::from(s.leapfrogs)).sum();
        let (quiet, all) = (watch.quiet.into_inner(), watch.evaluations.into_inner());
        assert!(leapfrogs > 300 && all > leapfrogs);
        assert!(quiet >= leapfrogs - 1, "{quiet} quiet evaluations of {leapfrogs} leapfrogs");
    }
}

#[test]
fn the_count_counts() {
    let before = allocations();
    std::hint::black_box(Vec::<u64>::with_capacity(std::hint::black_box(3)));
    assert_eq!(allocations(), before + 1);
}
