//! What happens when the command is ended by a signal.

use std::process;

/// Exit code of a command that was interrupted: 128 and the number of the signal, as shells have it.
const INTERRUPTED: i32 = 130;

/// From now on a signal that ends the command removes half-written files first.
pub fn install() {
    // Where another handler is there already, signals end the process as that one has it.
    let _ = ctrlc::set_handler(|| {
        medial::remove_temporaries();
        process::exit(INTERRUPTED);
    });
}
