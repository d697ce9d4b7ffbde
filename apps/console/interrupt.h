#pragma once

namespace atelier {

/// From now on SIGINT and SIGTERM only note that they came, so that a run can end cleanly; a second
/// one ends the program at once. One that is ignored stays so.
void catch_interrupts();

/// SIGINT and SIGTERM end the program at once again: for work that keeps nothing that a clean end
/// would save. One that came before is still noted (`interrupted`); one that is ignored stays so.
void release_interrupts();

/// True once a signal came.
bool interrupted();

/// Ends the program by the signal that came, so that shells and schedulers see the cause.
[[noreturn]] void end_by_signal();

}  // namespace atelier
