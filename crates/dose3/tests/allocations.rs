//! A stream in steady state allocates nothing.

use dose3::stream::{Said, StreamOptions};
use dose3::{Detector, FitOptions};
use dose3_datasets::synthetic::{Platform, suite, trajectory};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, which counts for the thread that asks.
struct Counting;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

#[allow(unsafe_code)]
// SAFETY: every call is handed on to the system's allocator as it is.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        unsafe { System.realloc(pointer, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

#[test]
fn once_it_runs_a_stream_allocates_nothing() {
    let options = FitOptions {
        density: "mixture:2".parse().unwrap(),
        ..FitOptions::default()
    };
    let trusted = suite(Platform::Vehicle, 4, 1);
    let detector = Detector::builder().options(options).fit(&trusted).unwrap();
    let drive = trajectory(Platform::Vehicle, 40, 6000, 20.0);
    let mut stream = detector
        .stream(drive.frame, &StreamOptions::default())
        .unwrap();
    let mut windows = 0;
    let mut after = 0;
    for (i, (stamp, pose)) in drive.stamps.iter().zip(&drive.poses).enumerate() {
        if i == 1000 {
            after = COUNT.get();
            windows = 0;
        }
        for said in stream.push(*stamp, *pose).unwrap() {
            match said {
                Said::Window(_) => windows += 1,
                other => assert!(i < 1000, "{other:?}"),
            }
        }
    }
    assert_eq!(COUNT.get(), after);
    assert!(windows > 300);
}
