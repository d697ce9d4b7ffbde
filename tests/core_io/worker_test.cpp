#include "core/io/worker.h"

#include <csignal>
#include <cstdlib>
#include <fstream>
#include <numeric>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::AnyOf;
using ::testing::HasSubstr;

std::string worker_refusal(const std::function<std::vector<std::byte>()>& work,
                           const Limits& limits = {}) {
  try {
    run_in_worker(work, "x.h5", limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

// AddressSanitizer takes the signal, and memory that is refused, itself: it reports, and the
// process exits.
#if defined(__SANITIZE_ADDRESS__)
constexpr const char* kDied = "x.h5: the process that read it failed";
constexpr const char* kTooMuch = kDied;
#else
constexpr const char* kDied = "x.h5: the process that read it died: Segmentation fault";
constexpr const char* kTooMuch = "more than 64 MB of memory";
#endif

TEST(Worker, Result_IsReturned) {
  const std::vector<std::byte> large(3'000'000, std::byte{7});
  EXPECT_EQ(run_in_worker([&] { return large; }, "x", {}), large);
  EXPECT_TRUE(run_in_worker([] { return std::vector<std::byte>{}; }, "x", {}).empty());
}

TEST(Worker, Refusal_IsPassedOn) {
  EXPECT_EQ(worker_refusal(
                []() -> std::vector<std::byte> { throw DataError("", "here", "this", "that"); }),
            "x.h5: here: this; expected that");
}

TEST(Worker, Crash_IsDataError) {
  EXPECT_THAT(worker_refusal([]() -> std::vector<std::byte> {
                std::raise(SIGSEGV);
                return {};
              }),
              HasSubstr(kDied));
  EXPECT_THAT(worker_refusal([]() -> std::vector<std::byte> { _exit(3); }), HasSubstr("failed"));
  EXPECT_THAT(worker_refusal([]() -> std::vector<std::byte> { throw std::runtime_error("x"); }),
              HasSubstr("the process that read it"));
}

TEST(Worker, EndlessLoop_IsDataError) {
  Limits limits;
  limits.worker_cpu_seconds = 1;
  EXPECT_THAT(
      worker_refusal(
          []() -> std::vector<std::byte> {
            volatile bool forever = true;
            while (forever) {
            }
            return {};
          },
          limits),
      // On a busy machine the clock ends it before it has had its second.
      AnyOf(HasSubstr("more than 1 s of processor time"), HasSubstr("did not come to an end")));
}

TEST(Worker, TooMuchMemory_IsDataError) {
  Limits limits;
  limits.worker_memory_bytes = 64 << 20;
  EXPECT_THAT(worker_refusal([] { return std::vector<std::byte>(100 << 20); }, limits),
              HasSubstr(kTooMuch));
}

TEST(Worker, SandboxedWork_CannotOpenWriteOrConnect) {
  const fixtures::TemporaryDirectory folder;
  std::ofstream(folder / "secret") << "x";
  const std::string path = (folder / "secret").string();
  const std::vector<std::byte> reply = run_in_worker(
      [&] {
        std::vector<std::byte> worked;
        const auto note = [&](bool value) { worked.push_back(std::byte{value}); };
        note(open(path.c_str(), O_RDONLY) >= 0);
        note(open((path + "2").c_str(), O_CREAT | O_WRONLY, 0600) >= 0);
#if defined(__x86_64__)
        note(socket(AF_INET, SOCK_STREAM, 0) >= 0);
        note(unlink(path.c_str()) == 0);
        note(fork() >= 0);
        note(write(STDOUT_FILENO, "x", 1) >= 0);
#endif
        return worked;
      },
      "x", {});
  EXPECT_GE(reply.size(), 2u);
  for (std::size_t i = 0; i < reply.size(); ++i) {
    EXPECT_EQ(reply[i], std::byte{0}) << i;
  }
  EXPECT_TRUE(std::filesystem::exists(path));
}

TEST(Worker, ManyRunsInSequence_Work) {
  for (int i = 0; i < 100; ++i) {
    EXPECT_EQ(run_in_worker([&] { return std::vector<std::byte>{std::byte(i)}; }, "x", {})[0],
              std::byte(i));
  }
}

}  // namespace
}  // namespace atelier
