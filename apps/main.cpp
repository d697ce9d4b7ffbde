#include <CLI/CLI.hpp>
#include <csignal>
#include <exception>
#include <filesystem>
#include <iostream>
#include <new>
#include <string>
#include <vector>

#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include "apps/exit_code.h"
#include "apps/printable.h"
#include "apps/program.h"
#include "apps/standard_output.h"
#include "apps/usage_error.h"
#include "core/error.h"
#include "core/system_reason.h"

namespace {

int fail(int code, const std::string& what, bool lines = false) {
  std::cout.flush();
  std::string text = "atelier: " + atelier::printable(what, lines);
  for (std::size_t end = text.find('\n'); end != std::string::npos;
       end = text.find('\n', end + 1)) {
    text.insert(end + 1, "atelier: ");
  }
  std::cerr << text << std::endl;
  return code;
}

}  // namespace

/// The only catch of the program: every error becomes one readable line and an exit code.
int main(int argc, char** argv) {
  using namespace atelier;
  // A file beyond the limit of file sizes is a failing disk (EFBIG), no reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  const StandardOutput output;
  try {
    spdlog::set_default_logger(spdlog::stderr_color_mt("atelier"));
    spdlog::set_pattern("%v");
    const int code = run_program(std::vector<std::string>(argv + 1, argv + argc));
    std::cout.flush();
    if (!std::cout) {
      return fail(kExitEnvironment, "standard output: cannot write");
    }
    return code;
  } catch (const UsageError& error) {
    return fail(kExitUsage, error.what(), true);  // an options file may have several mistakes
  } catch (const CLI::ParseError& error) {
    return fail(kExitUsage, error.what());
  } catch (const DataError& error) {
    return fail(kExitBadData, error.what());
  } catch (const EnvironmentError& error) {
    return fail(kExitEnvironment, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return fail(kExitEnvironment,
                error.path1().string() + ": " + system_reason(error.code().value()));
  } catch (const std::bad_alloc&) {
    return fail(kExitEnvironment, "memory: there is not enough; use fewer --jobs or smaller data");
  } catch (const LogicError& error) {
    return fail(kExitBug, std::string(error.what()) + "; this is a defect of the program");
  } catch (const std::exception& error) {
    return fail(kExitBug, std::string(error.what()) + "; this is a defect of the program");
  }
}
