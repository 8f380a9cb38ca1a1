//! The DOSE3 noise estimator as a static CPU plan: forward and backward without allocation.
