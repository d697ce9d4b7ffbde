#pragma once

#include <streambuf>

#include <ext/stdio_filebuf.h>

namespace atelier {

/// Keeps standard output for the program's own text: while one lives, `std::cout` writes to where
/// standard output led, and what libraries print there by themselves (PCL's Poisson does, from
/// several threads) goes nowhere, so that it never stands between lines of --json. One at a time.
class StandardOutput {
 public:
  /// Where descriptors have run out, everything stays as it is.
  StandardOutput();
  ~StandardOutput();
  StandardOutput(const StandardOutput&) = delete;
  StandardOutput& operator=(const StandardOutput&) = delete;

 private:
  __gnu_cxx::stdio_filebuf<char> own_;
  std::streambuf* before_ = nullptr;
};

}  // namespace atelier
