//! How windows are noised when they are measured.

use crate::error::{Error, Result, Setting};
pub use dose3_diffusion::ProbePlan;
use dose3_diffusion::{NoiseSharing, Process};
use dose3_ood::StatisticsSet;

/// Noise draws of a window at most.
pub(crate) const MOST_DRAWS: usize = 10_000;

/// Checks `plan` against the process and what is to be measured; where no noise is drawn the answer has one draw.
///
/// # Errors
/// [`Error::Setting`] for steps that the process does not have or no draw, [`Error::NoNoise`] for denoising
/// errors of a path without drawn noise.
pub fn checked(
    plan: &ProbePlan,
    process: &Process,
    statistics: &StatisticsSet,
) -> Result<ProbePlan> {
    if !(1..=process.steps()).contains(&plan.steps) {
        let expected = format!("1 to the {} of the model", process.steps());
        return Err(Error::setting(Setting::Steps, plan.steps, expected));
    }
    if !(1..=MOST_DRAWS).contains(&plan.draws) {
        let expected = format!("1 to {MOST_DRAWS}");
        return Err(Error::setting(Setting::Draws, plan.draws, expected));
    }
    if plan.sharing == NoiseSharing::None && statistics.needs_noise() {
        return Err(Error::NoNoise {
            statistics: statistics.to_string(),
        });
    }
    Ok(ProbePlan {
        draws: plan.distinct_draws(),
        ..*plan
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_drawn_noise_there_is_one_draw_and_no_denoising_error() {
        let process = Process::new(dose3_diffusion::ProcessConfig::default()).unwrap();
        let plan = ProbePlan {
            steps: 6,
            draws: 3,
            seed: 0,
            sharing: NoiseSharing::None,
        };
        let check = |plan: &ProbePlan, set: &str| checked(plan, &process, &set.parse().unwrap());
        let found = check(&plan, "diffpath6+diffpath1").unwrap();
        assert_eq!((found.draws, found.steps), (1, 6));
        let refused = check(&plan, "kinematic,residual+eps-mean").unwrap_err();
        assert!(
            refused.to_string().contains("denoising errors"),
            "{refused}"
        );
        let drawn = ProbePlan {
            sharing: NoiseSharing::Shared,
            ..plan
        };
        assert_eq!(check(&drawn, "residual").unwrap().draws, 3);
        for bad in [
            ProbePlan { steps: 0, ..drawn },
            ProbePlan { steps: 31, ..drawn },
            ProbePlan { draws: 0, ..drawn },
            ProbePlan {
                draws: MOST_DRAWS + 1,
                ..drawn
            },
        ] {
            assert!(matches!(
                check(&bad, "residual"),
                Err(Error::Setting { .. })
            ));
        }
    }
}
