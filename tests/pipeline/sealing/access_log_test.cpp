// The log of a workspace: appended by several at once, and broken by every change.
#include "pipeline/sealing/access_log.h"

#include <fstream>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

class AccessLogTest : public ::testing::Test {
 protected:
  std::string text() const {
    std::ifstream file(folder_ / kAccessLog, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  void set(const std::string& text) const {
    std::ofstream(folder_ / kAccessLog, std::ios::binary) << text;
  }
  static std::string refusal(const std::string& text) {
    try {
      parse_access_log(text, "log");
    } catch (const DataError& error) {
      return error.what();
    }
    return "unbroken";
  }
  TemporaryDirectory folder_;
};

TEST_F(AccessLogTest, Lines_AreChained) {
  log_access(folder_.path(), "export", "files");
  log_access(folder_.path(), "seal", "a\tb\nc\x1b[2J\xff" + std::string(2000, 'x'));
  const AccessLog log = parse_access_log(text(), "log");
  ASSERT_EQ(log.entries.size(), 2U);
  EXPECT_EQ(log.entries[0].action, "export");
  EXPECT_EQ(log.entries[0].detail, "files");
  EXPECT_THAT(text(), HasSubstr(hex(log.head)));
  struct stat status {};
  ASSERT_EQ(stat((folder_ / kAccessLog).c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
}

TEST_F(AccessLogTest, EveryBitFlipAndMissingLine_IsNoticed) {
  for (int i = 0; i < 3; ++i) {
    log_access(folder_.path(), "export", std::to_string(i));
  }
  const std::string good = text();
  EXPECT_EQ(refusal(good), "unbroken");
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string wrong = good;
      wrong[i] = static_cast<char>(wrong[i] ^ (1 << bit));
      EXPECT_NE(refusal(wrong), "unbroken") << i << ", bit " << bit;
    }
  }
  const std::size_t first = good.find('\n') + 1;
  EXPECT_THAT(refusal(good.substr(first)), HasSubstr("line 1"));
  const std::size_t second = good.find('\n', first) + 1;
  EXPECT_THAT(refusal(good.substr(0, first) + good.substr(second)), HasSubstr("line 2"));
  // Cut at its end it is unbroken, and its head is another.
  EXPECT_NE(parse_access_log(good.substr(0, second), "").head, parse_access_log(good, "").head);
}

TEST_F(AccessLogTest, WhatACrashLeftOfALine_IsTakenAway) {
  log_access(folder_.path(), "export", "one");
  const std::string good = text();
  for (const std::size_t kept : {std::size_t{1}, std::size_t{20}}) {
    set(good + good.substr(0, kept));
    log_access(folder_.path(), "export", "two");
    EXPECT_EQ(parse_access_log(text(), "log").entries.size(), 2U);
  }
  set(good.substr(0, 30));
  log_access(folder_.path(), "export", "one");
  EXPECT_EQ(parse_access_log(text(), "log").entries.size(), 1U);
}

TEST_F(AccessLogTest, LogOfSomethingElse_IsNotAppendedTo) {
  set("hello\nworld\n");
  EXPECT_THROW(log_access(folder_.path(), "export", "one"), DataError);
  EXPECT_EQ(text(), "hello\nworld\n");
  for (const char* foreign : {"half a line", "2026-11-29 notes", "hello\nworld"}) {
    set(foreign);
    EXPECT_THROW(log_access(folder_.path(), "export", "one"), DataError);
    EXPECT_EQ(text(), foreign);
  }
}

TEST_F(AccessLogTest, SeveralAtOnce_LeaveOneChain) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) {
        log_access(folder_.path(), "export", "x");
      }
    });
  }
  for (std::thread& thread : threads) {
    thread.join();
  }
  EXPECT_EQ(parse_access_log(text(), "log").entries.size(), 40U);
}

}  // namespace
}  // namespace atelier::fixtures
