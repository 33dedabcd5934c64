//! Checks that evaluation does not allocate memory: it runs in every leapfrog step of a sampler.
#![expect(unsafe_code, reason = "only a global allocator sees every allocation")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

use surrogate::{Input, Pce};

struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<usize> = const { Cell::new(0) };
}

// SAFETY: every call is forwarded unchanged to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.set(ALLOCATIONS.get() + 1);
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn evaluation_allocates_nothing() {
    let inputs = ["a", "b"].map(|name| Input::new(name, 0.0, 1.0).unwrap());
    for degree in [1, 5, 16] {
        let terms = [([0, 0], [1.0]), ([degree, 1], [0.5]), ([0, degree], [0.1])];
        let pce =
            Pce::from_terms(inputs.clone(), ["f".into()], terms[..2].iter().copied()).unwrap();
        let before = ALLOCATIONS.get();
        // points inside, on the boundary, and just outside of the box
        for x in [[0.3, 0.6], [0.0, 1.0], [1.001, 0.5]] {
            std::hint::black_box(pce.value(&x).is_ok());
            std::hint::black_box(pce.value_and_jacobian(&x).is_ok());
        }
        assert_eq!(ALLOCATIONS.get(), before);
    }
    // check that the counter works
    let before = ALLOCATIONS.get();
    std::hint::black_box(vec![1.0f64; 3]);
    assert_eq!(ALLOCATIONS.get(), before + 1);
}
