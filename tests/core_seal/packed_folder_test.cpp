// Folders in archives: what goes in comes out, tar(1) reads it, and nothing leaves the folder.
#include "core/seal/packed_folder.h"

#include <algorithm>
#include <fstream>
#include <map>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/error.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

namespace fs = std::filesystem;

constexpr std::size_t kBlock = 512;

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

/// Every file and link below a folder, with what it holds.
std::map<std::string, std::string> content(const fs::path& folder) {
  std::map<std::string, std::string> all;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (entry.is_symlink()) {
      all[name] = "-> " + fs::read_symlink(entry.path()).string();
    } else if (entry.is_directory()) {
      all[name] = "folder";
    } else {
      std::ifstream file(entry.path(), std::ios::binary);
      all[name] = {std::istreambuf_iterator<char>(file), {}};
    }
  }
  return all;
}

ByteSource source_of(const std::string& bytes) {
  return [bytes, at = std::size_t{0}](std::span<std::uint8_t> buffer) mutable {
    const std::size_t count = std::min(buffer.size(), bytes.size() - at);
    std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(at), count, buffer.begin());
    at += count;
    return count;
  };
}

/// An archive of entries that TarWriter would not write.
class Forged {
 public:
  Forged& add(char type, const std::string& path, const std::string& text = "",
              const std::string& target = "", const std::string& size = "") {
    std::string block(kBlock, '\0');
    block.replace(0, std::min<std::size_t>(path.size(), 100), path.substr(0, 100));
    char digits[16];
    std::snprintf(digits, sizeof digits, "%011zo", text.size());
    block.replace(124, 11, size.empty() ? std::string(digits) : size);
    block[156] = type;
    block.replace(157, target.size(), target);
    block.replace(257, 5, "ustar");
    block.replace(263, 2, "00");
    block.replace(148, 8, "        ");
    unsigned sum = 0;
    for (const char c : block) {
      sum += static_cast<unsigned char>(c);
    }
    std::snprintf(digits, sizeof digits, "%06o", sum);
    block.replace(148, 7, std::string(digits, 6) + '\0');
    bytes_ += block + text + std::string((kBlock - text.size() % kBlock) % kBlock, '\0');
    return *this;
  }
  std::string bytes() const { return bytes_ + std::string(2 * kBlock, '\0'); }

 private:
  std::string bytes_;
};

class PackedFolderTest : public ::testing::Test {
 protected:
  std::string packed(const fs::path& folder) const {
    std::string bytes;
    pack_folder(folder, {".note", "first"},
                [&](Bytes piece) { bytes.append(piece.begin(), piece.end()); });
    return bytes;
  }
  std::string refusal(const std::string& archive) {
    const fs::path out = root_ / ("out" + std::to_string(++outs_));
    try {
      unpack_folder(source_of(archive), out, "a.sealed");
    } catch (const DataError& error) {
      return error.what();
    } catch (const EnvironmentError& error) {
      return error.what();
    }
    return "unpacked";
  }
  TemporaryDirectory root_;
  int outs_ = 0;
};

TEST_F(PackedFolderTest, Folder_ComesBackWithoutWhatIsHidden) {
  const fs::path in = root_ / "in";
  write(in / "statistics/0123456789abcdef/manifest.json", "{}");
  write(in / "statistics/0123456789abcdef/large", std::string(700'001, 'x'));
  write(in / "statistics/.lock", "");
  write(in / ("long_" + std::string(90, 'a')) / ("b" + std::string(200, 'b')) / "c.txt", "c");
  write(in / (std::string(100, 'd') + "/" + std::string(99, 'e')), "exactly");
  fs::create_symlink("0123456789abcdef", in / "statistics/current");
  fs::create_directories(in / "empty");
  const std::string bytes = packed(in);
  const fs::path out = root_ / "out";
  const PackedFolder unpacked = unpack_folder(source_of(bytes), out, "a");
  EXPECT_EQ(unpacked.files, 5);
  auto expected = content(in);
  expected.erase("statistics/.lock");
  expected[".note"] = "first";
  EXPECT_EQ(content(out), expected);
  struct stat status {};
  ASSERT_EQ(stat((out / ".note").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0600U);
  ASSERT_EQ(stat((out / "empty").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777, 0700U);
}

TEST_F(PackedFolderTest, Archive_IsReadByTar) {
  ATELIER_NEEDS_PROGRAM("tar");
  const fs::path in = root_ / "in";
  write(in / ("long_" + std::string(120, 'a')) / ("b" + std::string(200, 'b')) / "c.txt", "c");
  write(in / "d/e.bin", std::string(100'000, 'e'));
  write(root_ / "a.tar", packed(in));
  fs::create_directories(root_ / "out");
  const ChildResult result =
      run_child({"tar", "-xf", (root_ / "a.tar").string(), "-C", (root_ / "out").string()});
  EXPECT_EQ(result.exit_code, 0) << result.err;
  auto expected = content(in);
  expected[".note"] = "first";
  EXPECT_EQ(content(root_ / "out"), expected);
}

TEST_F(PackedFolderTest, ArchiveOfTar_IsRead) {
  ATELIER_NEEDS_PROGRAM("tar");
  const fs::path in = root_ / "in";
  write(in / "d/e.bin", std::string(3'000, 'e'));
  const std::string archive = (root_ / "a.tar").string();
  ASSERT_EQ(run_child({"tar", "--format=pax", "-cf", archive, "-C", in.string(), "d"}).exit_code,
            0);
  std::ifstream file(archive, std::ios::binary);
  EXPECT_EQ(refusal({std::istreambuf_iterator<char>(file), {}}), "unpacked");
}

TEST_F(PackedFolderTest, LinkOrPipe_IsNotPacked) {
  const fs::path in = root_ / "in";
  write(in / "a", "a");
  fs::create_symlink("/etc/passwd", in / "secret");
  EXPECT_THROW(packed(in), DataError);
  fs::remove(in / "secret");
  ASSERT_EQ(mkfifo((in / "pipe").c_str(), 0600), 0);
  EXPECT_THROW(packed(in), DataError);
}

TEST_F(PackedFolderTest, PathsThatLeaveTheFolder_AreRefused) {
  for (const std::string& path :
       {std::string("../a"), std::string("/a"), std::string("a/../b"), std::string("a//b"),
        std::string("./a"), std::string(""), std::string("a\nb"), std::string("a\x1b[m"),
        std::string("\xff")}) {
    EXPECT_THAT(refusal(Forged().add('0', path, "x").bytes()), HasSubstr("unsafe path")) << path;
  }
  std::string deep = "a";
  for (int i = 0; i < 40; ++i) {
    deep += "/a";
  }
  EXPECT_THAT(refusal(Forged().add('0', deep, "x").bytes()), HasSubstr("unsafe path"));
  EXPECT_FALSE(fs::exists(root_ / "a"));
}

TEST_F(PackedFolderTest, LinksAndDevices_AreRefused) {
  EXPECT_THAT(refusal(Forged().add('2', "a", "", "/etc").bytes()), HasSubstr("a link"));
  EXPECT_THAT(refusal(Forged().add('2', "s/current", "", "../..").bytes()), HasSubstr("a link"));
  EXPECT_THAT(refusal(Forged().add('1', "a", "", "b").bytes()), HasSubstr("hard link"));
  for (const char type : {'3', '4', '6'}) {
    EXPECT_THAT(refusal(Forged().add(type, "a").bytes()), HasSubstr("a device or a pipe"));
  }
  for (const char type : {'7', 'L', 'K', 'S', 'g', 'V'}) {
    EXPECT_THAT(refusal(Forged().add(type, "a").bytes()), HasSubstr("another type"));
  }
}

TEST_F(PackedFolderTest, LinkInTheArchive_IsNotWrittenThrough) {
  const std::string key = "0123456789abcdef";
  EXPECT_NE(refusal(Forged().add('2', "s/current", "", key).add('0', "s/current/a", "x").bytes()),
            "unpacked");
  EXPECT_NE(refusal(Forged().add('0', "s/current", "x").add('2', "s/current", "", key).bytes()),
            "unpacked");
}

TEST_F(PackedFolderTest, PathThatComesTwice_IsRefused) {
  EXPECT_THAT(refusal(Forged().add('0', "a", "x").add('0', "a", "y").bytes()), HasSubstr("twice"));
  EXPECT_THAT(refusal(Forged().add('5', "a/").add('0', "a", "y").bytes()), HasSubstr("twice"));
  EXPECT_NE(refusal(Forged().add('0', "a", "x").add('0', "a/b", "y").bytes()), "unpacked");
}

TEST_F(PackedFolderTest, SizesThatLie_AreRefused) {
  EXPECT_THAT(refusal(Forged().add('0', "a", "x", "", "77777777777").bytes()),
              HasSubstr("ends too early"));
  EXPECT_THAT(refusal(Forged().add('0', "a", "x", "", "-0000000001").bytes()),
              HasSubstr("no number"));
  EXPECT_THAT(refusal(Forged().add('5', "a/", "x").bytes()), HasSubstr("a size"));
  EXPECT_THAT(refusal(Forged().add('x', "p", "29 size=99999999999999999999\n").bytes()),
              HasSubstr("no number"));
  EXPECT_THAT(refusal(Forged().add('x', "p", std::string(20'000, 'x')).bytes()),
              HasSubstr("extended header of"));
  EXPECT_THAT(refusal(Forged().add('x', "p", "24 linkpath=/etc/passwd\n").bytes()),
              HasSubstr("extended header"));
}

TEST_F(PackedFolderTest, FileOfMoreThan8GiB_KeepsItsSize) {
  constexpr std::int64_t kSize = (std::int64_t{9} << 30) + 5;
  const std::vector<std::uint8_t> piece(std::size_t{1} << 20);
  std::string start;
  std::int64_t written = 0;
  TarWriter writer([&](Bytes bytes) {
    if (start.size() < 16 * kBlock) {
      start.append(bytes.begin(), bytes.begin() + std::min(std::ssize(bytes), std::ssize(piece)));
    }
    written += std::ssize(bytes);
  });
  writer.add({"large", TarEntry::Kind::File, kSize, ""});
  for (std::int64_t left = kSize; left > 0; left -= std::ssize(piece)) {
    writer.write(Bytes(piece).first(static_cast<std::size_t>(std::min(left, std::ssize(piece)))));
  }
  writer.finish();
  EXPECT_EQ(written, writer.bytes());
  EXPECT_GT(written, kSize);
  TarReader reader(source_of(start), "a.sealed");
  const auto entry = reader.next();
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->path, "large");
  EXPECT_EQ(entry->size, kSize);
}

TEST_F(PackedFolderTest, EveryTruncationAndWhatFollowsTheEnd_AreRefused) {
  write(root_ / "in/a", "text");
  const std::string good = packed(root_ / "in");
  const std::string plain = good.substr(0, good.find_last_not_of('\0') + 1);
  for (std::size_t size = 0; size < plain.size(); size += 16) {
    EXPECT_NE(refusal(good.substr(0, size)), "unpacked") << size;
  }
  EXPECT_THAT(refusal(good + std::string(kBlock, 'x')), HasSubstr("behind the end"));
}

TEST(PaddedSize, Scale_CostsLittleAndNeverShrinks) {
  for (std::int64_t size = 2; size < 1'000'000; size += 1 + size / 100) {
    EXPECT_GE(padded_size(size), size);
    EXPECT_LE(static_cast<double>(padded_size(size)), 1.12 * static_cast<double>(size) + 1) << size;
    EXPECT_EQ(padded_size(padded_size(size)), padded_size(size));
  }
  EXPECT_LE(static_cast<double>(padded_size(1'000'000'001)), 1.032e9);
  EXPECT_EQ(padded_size(9), 10);  // as in the table of its authors: 1001b to 1010b
}

}  // namespace
}  // namespace atelier::fixtures
