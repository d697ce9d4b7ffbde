#include "core/store/unfinished_folder.h"

#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

namespace fs = std::filesystem;

void write_something(const fs::path& folder) {
  fs::create_directories(folder);
  std::ofstream(folder / "file") << "x";
}

TEST(UnfinishedFolder, FinishedFolder_AppearsAtItsPlace) {
  const TemporaryDirectory root;
  {
    const UnfinishedFolder folder(root / "new" / "out/");
    write_something(folder.content());
    EXPECT_FALSE(fs::exists(root / "new" / "out"));
    folder.finish();
  }
  EXPECT_TRUE(fs::exists(root / "new" / "out" / "file"));
  EXPECT_FALSE(fs::exists(root / "new" / ".out.unfinished"));
}

TEST(UnfinishedFolder, UnfinishedFolder_LeavesNothing) {
  const TemporaryDirectory root;
  {
    const UnfinishedFolder folder(root / "new" / "out");
    write_something(folder.content());
  }
  EXPECT_FALSE(fs::exists(root / "new")) << "the folder above was made for it";
}

TEST(UnfinishedFolder, LeftoversOfAKilledRun_AreReplaced) {
  const TemporaryDirectory root;
  write_something(root / ".out.unfinished" / "out");
  const UnfinishedFolder folder(root / "out");
  EXPECT_FALSE(fs::exists(folder.content()));
}

TEST(UnfinishedFolder, FolderOfAnotherRun_IsRefused) {
  const TemporaryDirectory root;
  const UnfinishedFolder first(root / "out");
  write_something(first.content());
  EXPECT_THROW(UnfinishedFolder(root / "out"), EnvironmentError);
  EXPECT_TRUE(fs::exists(first.content() / "file")) << "the first one's";
}

}  // namespace
}  // namespace atelier::fixtures
