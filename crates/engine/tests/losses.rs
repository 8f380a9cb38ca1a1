//! What a loss may do while the engine waits for it.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use dose3_engine::Engine;
use dose3_model::{NoiseModel, Parameters, UNetConfig};
use rayon::prelude::*;

mod support;

use support::{Batch, engine, parameters, pool};

/// A network that takes no time, and a batch of eight chunks.
fn tiny() -> (Parameters, Batch) {
    let config = UNetConfig::new(3, 3, 8, &[1]);
    let batch = Batch::new(&config, 64, 4, 17);
    (parameters(&config, 16), batch)
}

/// As [`Batch::gradient`], with a loss that has work of its own for the thread pool. While it
/// waits for that, its thread takes whatever else the pool has; the pieces sleep so that it
/// has to wait.
fn gradient_with_parallel_loss(engine: &mut Engine, batch: &Batch) -> Vec<f32> {
    let plain = batch.loss();
    let loss = |first: usize, output: &[f32], gradient: &mut [f32]| {
        let pieces = (0..4).into_par_iter();
        pieces.for_each(|_| std::thread::sleep(Duration::from_micros(20)));
        plain(first, output, gradient);
    };
    let mut gradient = vec![0.0; engine.config().parameter_count()];
    engine
        .forward_backward(batch.input(), &loss, &mut gradient)
        .expect("backward");
    gradient
}

#[test]
fn a_loss_may_use_the_thread_pool_itself() {
    let (parameters, batch) = tiny();
    let expected = pool(1).install(|| batch.gradient(&mut engine(&parameters)));
    let mut engine = engine(&parameters);
    // A thousand times, for a deadlock is a matter of chance; and with more threads than cores.
    for threads in [2, 4, 8, 16] {
        pool(threads).install(|| {
            for _ in 0..250 {
                assert_eq!(gradient_with_parallel_loss(&mut engine, &batch), expected);
            }
        });
    }
}

#[test]
fn engines_may_share_a_pool_and_be_called_from_within() {
    let (parameters, batch) = tiny();
    let expected = pool(1).install(|| batch.gradient(&mut engine(&parameters)));
    for threads in [1, 2, 4] {
        let mut engines: Vec<Engine> = (0..8).map(|_| engine(&parameters)).collect();
        pool(threads).install(|| {
            engines.par_iter_mut().for_each(|engine| {
                for _ in 0..10 {
                    assert_eq!(gradient_with_parallel_loss(engine, &batch), expected);
                }
            });
        });
    }
}

#[test]
fn a_panic_in_the_loss_reaches_the_caller() {
    let (parameters, batch) = tiny();
    for threads in [1, 4] {
        pool(threads).install(|| {
            let mut engine = engine(&parameters);
            let expected = batch.gradient(&mut engine);
            let mut gradient = vec![0.0; parameters.values.len()];
            let loss = |first: usize, _: &[f32], _: &mut [f32]| assert!(first < 8, "refused");
            let call = || engine.forward_backward(batch.input(), &loss, &mut gradient);
            assert!(catch_unwind(AssertUnwindSafe(call)).is_err());
            // And the engine still works.
            assert_eq!(batch.gradient(&mut engine), expected);
        });
    }
}
