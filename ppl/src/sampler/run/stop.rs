//! Reasons for which a chain ends before its last draw.

use serde::{Deserialize, Serialize};

use crate::density::FatalError;

/// Reason for which a chain ended before its last draw. Files store the reason as the text of its message.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[serde(into = "String", from = "String")]
pub enum StopReason {
    /// The flag of [`interrupt`](crate::Mcmc::interrupt) became true.
    #[error("interrupted")]
    Interrupted,
    /// Another chain of the run ended early, so that this chain was stopped too.
    #[error("stopped because another chain failed")]
    OtherChain,
    /// The density reported a fatal error.
    #[error(transparent)]
    Fatal(Box<FatalError>),
}

impl From<StopReason> for String {
    fn from(reason: StopReason) -> Self {
        reason.to_string()
    }
}

impl From<String> for StopReason {
    fn from(words: String) -> Self {
        let reasons = [Self::Interrupted, Self::OtherChain];
        let reason = reasons.into_iter().find(|reason| reason.to_string() == words);
        reason.unwrap_or_else(|| Self::Fatal(Box::new(FatalError::other(words))))
    }
}
