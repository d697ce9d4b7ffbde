#include "apps/console/standard_streams.h"

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <iostream>

#include <fcntl.h>
#include <unistd.h>

#include "core/system_reason.h"

namespace atelier {
namespace {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr bool kSanitized = true;
#else
constexpr bool kSanitized = false;
#endif

// Standard output was closed when the program began.
bool output_was_closed = false;

// Where standard error leads: one for the process, as it is itself.
int own_error = STDERR_FILENO;
std::ostream* own_stream = &std::cerr;
std::terminate_handler before_terminate = nullptr;

[[noreturn]] void terminate_aloud() {
  dup2(own_error, STDERR_FILENO);
  before_terminate();
  std::abort();
}

}  // namespace

void fill_closed_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) < 0) {
      output_was_closed = output_was_closed || stream == STDOUT_FILENO;
      // The least number that is free: this one.
      open(stream == STDOUT_FILENO ? "/dev/full" : "/dev/null", O_RDWR);
    }
  }
}

template <class Result>
Result StandardStreams::Buffer::noted(Result result, bool failed) {
  if (failed && error_ == 0) {
    error_ = errno;
  }
  return result;
}

StandardStreams::Buffer::int_type StandardStreams::Buffer::overflow(int_type c) {
  const int_type result = stdio_filebuf::overflow(c);
  return noted(result, result == traits_type::eof());
}

std::streamsize StandardStreams::Buffer::xsputn(const char* text, std::streamsize count) {
  const std::streamsize written = stdio_filebuf::xsputn(text, count);
  return noted(written, written != count);
}

int StandardStreams::Buffer::sync() {
  const int result = stdio_filebuf::sync();
  return noted(result, result != 0);
}

StandardStreams::Kept::Kept(int descriptor, int nowhere) : descriptor_(descriptor) {
  const int own = nowhere < 0 ? -1 : fcntl(descriptor, F_DUPFD_CLOEXEC, STDERR_FILENO + 1);
  if (own < 0) {
    return;
  }
  own_ = Buffer(own, std::ios::out);
  if (!own_.is_open()) {  // a stream that was opened to be read
    close(own);
    return;
  }
  kept_ = dup2(nowhere, descriptor) >= 0;
}

StandardStreams::Kept::~Kept() {
  if (kept_) {
    own_.pubsync();
    dup2(own_.fd(), descriptor_);
  }
}

StandardStreams::StandardStreams()
    : nowhere_((std::cout.flush(), std::fflush(stdout), open("/dev/null", O_WRONLY | O_CLOEXEC))),
      output_(STDOUT_FILENO, nowhere_),
      error_(STDERR_FILENO, kSanitized ? -1 : nowhere_),
      error_stream_(&error_.own()) {
  if (nowhere_ >= 0) {
    close(nowhere_);
  }
  if (output_.is_kept()) {
    output_before_ = std::cout.rdbuf(&output_.own());
  }
  if (error_.is_kept()) {
    error_stream_ << std::unitbuf;
    own_error = error_.own().fd();
    own_stream = &error_stream_;
  }
  before_terminate = std::set_terminate(terminate_aloud);
}

StandardStreams::~StandardStreams() {
  std::set_terminate(before_terminate);
  own_error = STDERR_FILENO;
  own_stream = &std::cerr;
  if (output_before_ != nullptr) {
    std::cout.flush();
    std::cout.rdbuf(output_before_);
  }
  std::fflush(stdout);  // what others printed waits in stdio until here
}

std::string StandardStreams::output_reason() const {
  const int error = output_.own().error();
  return output_was_closed ? "it is closed; redirect it to a file or to /dev/null"
         : error != 0      ? "cannot write: " + system_reason(error)
                           : "it cannot be written to; redirect it to a file or to /dev/null";
}

std::ostream& standard_error() {
  return *own_stream;
}

bool errors_on_terminal() {
  return isatty(own_error) == 1;
}

}  // namespace atelier
