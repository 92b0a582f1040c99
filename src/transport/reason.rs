//! Why shared memory does not work, in words, and what to do about it.
//!
//! iceoryx2 shows an error as the name of its variant (`NodeCreationFailure::InsufficientPermissions`).
//! The innermost name is what happened; here it becomes words, followed by the remedy.

use std::fmt::Display;

/// What can be done, by the names of iceoryx2's errors.
const REMEDIES: &[(&[&str], &str)] = &[
    (
        &["InsufficientPermissions"],
        "files of another user are there: run all processes of a run as one user, or remove \
         /dev/shm/groundloop* once none of them runs",
    ),
    (
        &["ServiceInCorruptedState", "SystemCorrupted", "ConnectionCorrupted", "CorruptedState"],
        "a process that was killed has left files behind: end all processes of groundloop, then \
         remove /dev/shm/groundloop*",
    ),
    (
        &["HangsInCreation", "IsBeingCreatedByAnotherInstance", "SystemInFlux"],
        "another process has begun to create it and has not finished: end that process if it is \
         stopped, else try again",
    ),
    (
        &[
            "UnableToCreateDataSegment",
            "UnableToCreatePortTag",
            "UnableToCreateServiceTag",
            "ServiceConfigCouldNotBeCreated",
            "ResourceCreationFailed",
            "OutOfMemory",
            "InternalError",
            "InternalFailure",
        ],
        "is /dev/shm full, or may this user not write there? `df -h /dev/shm` tells how full it is, \
         and --shm-size of a container raises it",
    ),
    (
        &["ExceedsMaxSupportedPublishers"],
        "another process writes it already: end it, or give this run a `run` of its own",
    ),
    (
        &[
            "ExceedsMaxSupportedSubscribers",
            "ExceedsMaxSupportedListeners",
            "ExceedsMaxSupportedNotifiers",
            "ExceedsMaxNumberOfNodes",
        ],
        "too many processes have joined the run: end one of them",
    ),
    (
        &[
            "DoesNotSupportRequestedAmountOfListeners",
            "DoesNotSupportRequestedAmountOfNodes",
            "DoesNotSupportRequestedAmountOfNotifiers",
            "DoesNotSupportRequestedAmountOfPublishers",
            "DoesNotSupportRequestedAmountOfSubscribers",
            "DoesNotSupportRequestedMaxEventId",
            "DoesNotSupportRequestedMinBufferSize",
            "DoesNotSupportRequestedMinHistorySize",
            "DoesNotSupportRequestedMinSubscriberBorrowedSamples",
            "IncompatibleAttributes",
            "IncompatibleDeadline",
            "IncompatibleMessagingPattern",
            "IncompatibleNotifierCreatedEvent",
            "IncompatibleNotifierDeadEvent",
            "IncompatibleNotifierDroppedEvent",
            "IncompatibleOverflowBehavior",
            "IncompatibleTypes",
            "VersionMismatch",
        ],
        "a process of another version of groundloop has it open: end it, or give this run a `run` \
         of its own",
    ),
    (&["ExceedsMaximumLength"], "the name or path is too long: choose a shorter `run`"),
    (&["InvalidContent"], "the name or path has a character that may not stand there"),
];

/// What happened, and what to do about it.
pub(super) fn reason(error: &dyn Display) -> String {
    let text = error.to_string();
    if text.contains(char::is_whitespace) {
        return text; // a sentence already, such as the system's
    }
    let mut parts = text.split(|c: char| !c.is_alphanumeric()).filter(|part| !part.is_empty());
    let name = parts.next_back().unwrap_or(&text);
    let remedy = REMEDIES.iter().find(|(names, _)| names.contains(&name));
    let remedy = remedy.map(|(_, remedy)| format!(" ({remedy})")).unwrap_or_default();
    format!("{}{remedy}", in_words(name))
}

/// `OutOfMemory` as "out of memory".
fn in_words(name: &str) -> String {
    let mut words = String::new();
    for c in name.chars() {
        if c.is_uppercase() && !words.is_empty() {
            words.push(' ');
        }
        words.extend(c.to_lowercase());
    }
    words
}

#[cfg(test)]
mod tests {
    use iceoryx2::node::NodeCreationFailure;
    use iceoryx2::port::{LoanError, ReceiveError, SendError};
    use iceoryx2::prelude::*;
    use iceoryx2::service::builder::publish_subscribe::{
        PublishSubscribeOpenError, PublishSubscribeOpenOrCreateError,
    };

    use super::*;

    #[test]
    fn errors_are_words_with_a_remedy() {
        let incompatible = PublishSubscribeOpenOrCreateError::PublishSubscribeOpenError(
            PublishSubscribeOpenError::IncompatibleTypes,
        );
        let errors: [&dyn Display; 5] = [
            &NodeCreationFailure::InsufficientPermissions,
            &incompatible,
            &SendError::LoanError(LoanError::OutOfMemory),
            &ReceiveError::ExceedsMaxBorrows,
            &std::io::Error::from_raw_os_error(24),
        ];
        insta::assert_snapshot!(errors.map(reason).join("\n"), @r"
        insufficient permissions (files of another user are there: run all processes of a run as one user, or remove /dev/shm/groundloop* once none of them runs)
        incompatible types (a process of another version of groundloop has it open: end it, or give this run a `run` of its own)
        out of memory (is /dev/shm full, or may this user not write there? `df -h /dev/shm` tells how full it is, and --shm-size of a container raises it)
        exceeds max borrows
        Too many open files (os error 24)
        ");
    }

    /// A name that iceoryx2 does not have would never be found.
    #[test]
    fn names_are_of_errors_that_there_are() {
        assert!(ServiceName::new("").is_err_and(|e| reason(&e).starts_with("invalid content (")));
        let long = "x".repeat(1000);
        assert!(
            ServiceName::new(&long)
                .is_err_and(|e| reason(&e).starts_with("exceeds maximum length ("))
        );
    }
}
