#include "core/regular_file.h"

#include <array>
#include <cstddef>
#include <fstream>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

class RegularFileTest : public ::testing::Test {
 protected:
  RegularFileTest() { std::ofstream(root_ / "file") << "abc"; }
  template <class Error>
  static std::string refusal(const std::filesystem::path& path, int flags = 0) {
    try {
      const RegularFile file(path, flags);
    } catch (const Error& error) {
      return error.what();
    }
    return "it was opened";
  }
  TemporaryDirectory root_;
};

TEST_F(RegularFileTest, RegularFile_Opens) {
  const RegularFile file(root_ / "file");
  EXPECT_EQ(file.size(), 3);
  EXPECT_GE(file.descriptor(), 0);
}

TEST_F(RegularFileTest, ReadOn_GivesPiecesUntilTheEnd) {
  const RegularFile file(root_ / "file");
  std::array<std::byte, 2> piece{};
  EXPECT_EQ(file.read_on(piece, "file"), 2U);
  EXPECT_EQ(piece[1], std::byte('b'));
  EXPECT_EQ(file.read_on(piece, "file"), 1U);
  EXPECT_EQ(piece[0], std::byte('c'));
  EXPECT_EQ(file.read_on(piece, "file"), 0U);
}

TEST_F(RegularFileTest, PipeFolderOrMissingFile_IsRefused) {
  ASSERT_EQ(mkfifo((root_ / "pipe").c_str(), 0600), 0);
  std::filesystem::create_symlink("loop", root_ / "loop");
  EXPECT_THAT(refusal<DataError>(root_ / "pipe"), HasSubstr("not a regular file"));
  EXPECT_THAT(refusal<DataError>(root_ / "loop"), HasSubstr("not a regular file"));
  EXPECT_THAT(refusal<DataError>("/dev/null"), HasSubstr("not a regular file"));
  EXPECT_THAT(refusal<DataError>(root_.path()), HasSubstr("a folder"));
  EXPECT_THAT(refusal<DataError>(root_ / "nothing"), HasSubstr("No such file"));
}

TEST_F(RegularFileTest, PointerOfGitLfs_IsRefusedWhereContentIsRead) {
  std::ofstream(root_ / "mesh.ply") << "version https://git-lfs.github.com/spec/v1\noid sha256:"
                                       "26d0f95e29cb87cf129d3b794aad50a28bd4ead97760527e072452197cb"
                                       "a3415\nsize 381\n";
  const RegularFile pointer(root_ / "mesh.ply");  // may be counted and digested
  EXPECT_THAT([&] { pointer.check_size(1 << 20, root_ / "mesh.ply"); },
              ::testing::ThrowsMessage<DataError>(::testing::AllOf(
                  HasSubstr("mesh.ply"), HasSubstr("Git LFS"), HasSubstr("git lfs pull"))));
  EXPECT_NO_THROW(RegularFile(root_ / "file").check_size(10, root_ / "file"));
}

TEST_F(RegularFileTest, SymbolicLinkWithNoFollow_IsRefused) {
  std::filesystem::create_symlink(root_ / "file", root_ / "link");
  EXPECT_EQ(RegularFile(root_ / "link").size(), 3);
  EXPECT_THAT(refusal<DataError>(root_ / "link", O_NOFOLLOW), HasSubstr("a symbolic link"));
}

TEST_F(RegularFileTest, UnreadableFile_IsEnvironmentError) {
  std::filesystem::permissions(root_ / "file", std::filesystem::perms::none);
  std::filesystem::permissions(root_.path(), std::filesystem::perms(0755));
  const uid_t self = geteuid();
  if (self == 0 && seteuid(65534) != 0) {  // the superuser may read everything
    GTEST_SKIP() << "cannot become another user";
  }
  const std::string words = refusal<EnvironmentError>(root_ / "file");
  ASSERT_EQ(seteuid(self), 0);
  EXPECT_THAT(words, HasSubstr("cannot open: Permission denied"));
}

}  // namespace
}  // namespace atelier::fixtures
