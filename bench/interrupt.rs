//! Interrupts from the keyboard, and requests to end.
//!
//! A verb with many items polls a flag ([`listen`]): it ends its workers, keeps the finished records
//! and prints how to resume. Every other verb ends at once.

use std::sync::atomic::{AtomicBool, Ordering};

use crate::exit::Exit;
use crate::process_tree;

static INTERRUPTED: AtomicBool = AtomicBool::new(false);
static LISTENING: AtomicBool = AtomicBool::new(false);

/// Takes over interrupts (SIGINT, SIGTERM, SIGHUP) for the rest of the process. A second one always ends it at once.
pub fn install() {
    // Without a handler the system ends the process, which is acceptable.
    let _ = ctrlc::set_handler(|| {
        // A flag alone: the handler interrupts other threads and must not wait for a lock.
        let again = INTERRUPTED.swap(true, Ordering::Relaxed);
        if again || !LISTENING.load(Ordering::Relaxed) {
            // A plug-in's program would continue.
            process_tree::end_descendants();
            medial::remove_temporaries();
            std::process::exit(Exit::Interrupted as i32);
        }
    });
}

/// From now on an interrupt only sets the returned flag, until [`stop_listening`].
pub fn listen() -> &'static AtomicBool {
    LISTENING.store(true, Ordering::Relaxed);
    &INTERRUPTED
}

/// From now on an interrupt ends the process at once again. Returns whether one came before.
pub fn stop_listening() -> bool {
    LISTENING.store(false, Ordering::Relaxed);
    INTERRUPTED.load(Ordering::Relaxed)
}
