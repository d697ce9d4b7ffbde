#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <iostream>
#include <memory>
#include <string>
#include <vector>

#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include "apps/console/failure.h"
#include "apps/console/program.h"
#include "apps/console/standard_streams.h"
#include "core/exit_code.h"
#include "core/printable.h"

namespace {

int fail(int code, const std::string& what, bool lines = false) {
  std::cout.flush();
  std::string text = "atelier: " + atelier::printable(what, lines);
  for (std::size_t end = text.find('\n'); end != std::string::npos;
       end = text.find('\n', end + 1)) {
    text.insert(end + 1, "atelier: ");
  }
  atelier::standard_error() << text << std::endl;
  return code;
}

}  // namespace

/// Every error that ends the program becomes one readable line and an exit code here.
int main(int argc, char** argv) {
  using namespace atelier;
  // A file beyond the limit of file sizes is a failing disk (EFBIG), no reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  fill_closed_streams();
  const StandardStreams streams;
  try {
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "atelier", std::make_shared<spdlog::sinks::ostream_sink_mt>(standard_error(), true)));
    spdlog::set_pattern("%v");
    const int code = run_program(std::vector<std::string>(argv + 1, argv + argc));
    std::cout.flush();
    if (!std::cout) {
      return fail(kExitEnvironment, "standard output: " + streams.output_reason());
    }
    return code;
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what());
  } catch (const std::exception& error) {
    const Failure failure = failure_of(error);
    // An options file may have several mistakes, and several people may not have consented.
    return fail(failure.exit_code, failure.text,
                failure.exit_code == kExitUsage || failure.exit_code == kExitCheckFailed);
  }
}
