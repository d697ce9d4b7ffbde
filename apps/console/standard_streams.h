#pragma once

#include <ostream>
#include <streambuf>
#include <string>

#include <ext/stdio_filebuf.h>

namespace atelier {

/// Opens /dev/null in the place of each standard stream that is closed, so that no file gets its
/// number, and with it what is printed there. Writing to standard output fails as if it were
/// closed.
void fill_closed_streams();

/// Keeps standard output and standard error for the program's own text: while one lives,
/// `std::cout` and `standard_error` write to where they led, and what libraries print by themselves
/// (PCL's Poisson, from several threads; OpenCV, to `std::cerr`; FFmpeg and codecs) goes nowhere,
/// so that it never stands between lines of --json, nor beside the one line of an error. One at a
/// time.
///
/// Messages of std::terminate are still printed. Under sanitizers standard error stays as it is,
/// since their reports go there.
class StandardStreams {
 public:
  /// Where descriptors have run out, everything stays as it is.
  StandardStreams();
  ~StandardStreams();
  StandardStreams(const StandardStreams&) = delete;
  StandardStreams& operator=(const StandardStreams&) = delete;

  /// Why writing to standard output failed, and what to do about it.
  std::string output_reason() const;

 private:
  /// Keeps why it could not write: streams only tell that they could not.
  class Buffer : public __gnu_cxx::stdio_filebuf<char> {
   public:
    using stdio_filebuf::stdio_filebuf;
    int error() const { return error_; }

   protected:
    int_type overflow(int_type c) override;
    std::streamsize xsputn(const char* text, std::streamsize count) override;
    int sync() override;

   private:
    template <class Result>
    Result noted(Result result, bool failed);
    int error_ = 0;  ///< the first errno; 0: none
  };

  /// Where one of them led, while /dev/null is in its place.
  class Kept {
   public:
    Kept(int descriptor, int nowhere);
    ~Kept();
    Kept(const Kept&) = delete;
    Kept& operator=(const Kept&) = delete;
    bool is_kept() const { return kept_; }
    Buffer& own() { return own_; }
    const Buffer& own() const { return own_; }

   private:
    int descriptor_;
    Buffer own_;
    bool kept_ = false;
  };

  int nowhere_;
  Kept output_;
  Kept error_;
  std::ostream error_stream_;
  std::streambuf* output_before_ = nullptr;
};

/// The stream for what the program says on standard error: `std::cerr` is the libraries'.
std::ostream& standard_error();

/// True if standard error leads to a terminal, whatever lies in its place now.
bool errors_on_terminal();

}  // namespace atelier
