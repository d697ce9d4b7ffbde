#pragma once

namespace atelier {

/// A function with C linkage of a shared object that is loaded when it is first asked for, so that
/// a program that does not need it starts without (docs/decisions/0009-heavy-libraries-late.md).
///
/// @param library  file name; looked for in `../lib/atelier` and `../lib` beside the program's
///                 folder, then in the program's run path and where the system keeps its own
/// @throws EnvironmentError if there is no such library or it has no such function
void* late_symbol(const char* library, const char* function);

/// The same with its type. Keep it (`static const auto function = ...`): the search costs
/// microseconds.
template <class Function>
Function* late_function(const char* library, const char* function) {
  return reinterpret_cast<Function*>(late_symbol(library, function));
}

}  // namespace atelier
