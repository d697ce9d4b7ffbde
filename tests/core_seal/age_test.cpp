// Sealed files: keys, header, payload, and that nothing which was changed is opened.
#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "core/seal/age_stream.h"
#include "core/seal/bech32.h"
#include "core/seal/sealed_file.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::size_t kChunk = 65'536;
constexpr const char* kForties =  // 32 bytes 0x42, as age's own tests have it
    "AGE-SECRET-KEY-1GFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPYYSJZGFPQ4EGAEX";
constexpr const char* kFortiesPublic =
    "age1zvkyg2lqzraa2lnjvqej32nkuu0ues2s82hzrye869xeexvn73equnujwj";

std::string plain_text(std::size_t size) {
  std::string text(size, '\0');
  for (std::size_t i = 0; i < size; ++i) {
    text[i] = static_cast<char>((i * 7 + i / 251) & 0xff);
  }
  return text;
}

std::string sealed(const std::string& plain, const AgeRecipients& to) {
  std::string out;
  AgeWriter writer(to, [&](Bytes bytes) { out.append(bytes.begin(), bytes.end()); });
  for (std::size_t at = 0; at < plain.size(); at += 1000) {
    writer.write(bytes_of(std::string_view(plain).substr(at, 1000)));
  }
  writer.finish();
  return out;
}

std::string opened(const std::string& file, const AgeKeys& keys) {
  std::size_t at = 0;
  AgeReader reader(
      [&](std::span<std::uint8_t> buffer) {
        const std::size_t count = std::min(buffer.size(), file.size() - at);
        std::copy_n(file.begin() + static_cast<std::ptrdiff_t>(at), count, buffer.begin());
        at += count;
        return count;
      },
      keys, "a.sealed");
  std::string plain;
  std::vector<std::uint8_t> buffer(10'000);
  for (std::size_t got = buffer.size(); got == buffer.size();) {
    got = reader.read(buffer);
    plain.append(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got));
  }
  return plain;
}

AgeRecipients to(const std::vector<const Identity*>& people) {
  AgeRecipients all;
  for (const Identity* one : people) {
    all.recipients.push_back(one->recipient);
  }
  return all;
}

AgeKeys keys_of(const Identity& identity) {
  AgeKeys keys;
  keys.identities.push_back({Secret(identity.secret.bytes()), identity.recipient});
  return keys;
}

AgeKeys passphrase(std::string_view text) {
  AgeKeys keys;
  keys.passphrase = Secret(bytes_of(text));
  return keys;
}

std::string refusal(const std::string& file, const AgeKeys& keys) {
  try {
    opened(file, keys);
  } catch (const DataError& error) {
    return error.what();
  }
  return "opened";
}

TEST(AgeKeys, KnownKey_HasItsRecipient) {
  const std::vector<Identity> identities = parse_identities(kForties, "key");
  ASSERT_EQ(identities.size(), 1U);
  EXPECT_EQ(recipient_text(identities[0].recipient), kFortiesPublic);
  EXPECT_EQ(identity_text(identities[0]).text(),
            "# public key: " + std::string(kFortiesPublic) + "\n" + kForties + "\n");
}

TEST(AgeKeys, Bech32OfItsStandard_IsRead) {
  std::vector<std::uint8_t> bytes(20);
  EXPECT_TRUE(read_bech32("abcdef1qpzry9x8gf2tvdw0s3jn54khce6mua7lmqqqxw", "abcdef", bytes));
  EXPECT_EQ(bytes[1], 0x44);
  EXPECT_EQ(bech32_text("abcdef", bytes), "abcdef1qpzry9x8gf2tvdw0s3jn54khce6mua7lmqqqxw");
}

TEST(AgeKeys, EverySlip_IsRefused) {
  const std::string good = kFortiesPublic;
  for (std::size_t i = 0; i < good.size(); ++i) {
    for (const char other : {'q', 'p', 'Q', '1', ' '}) {
      std::string wrong = good;
      wrong[i] = other;
      if (wrong != good) {
        EXPECT_THROW(parse_recipient(wrong), DataError) << wrong;
      }
    }
    EXPECT_THROW(parse_recipient(good.substr(0, i)), DataError);
  }
}

TEST(AgeKeys, WrongIdentities_AreRefusedWithoutBeingShown) {
  const std::string key = kForties;
  for (const std::string& wrong :
       {std::string(), std::string("# nothing\n"), std::string(kFortiesPublic),
        key.substr(0, key.size() - 1), key + "Q", "\n" + key + "\nnonsense"}) {
    try {
      parse_identities(wrong, "key");
      ADD_FAILURE() << wrong;
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), AllOf(Not(HasSubstr("GFPYYS")), Not(HasSubstr("nonsense"))));
    }
  }
  try {
    parse_recipient(key);
  } catch (const DataError& error) {
    EXPECT_THAT(error.what(), Not(HasSubstr("GFPYYS"))) << "a secret key given as a recipient";
  }
}

TEST(AgeStream, AnySize_IsOpenedByEachRecipientAlone) {
  const Identity one = new_identity();
  const Identity two = new_identity();
  const Identity three = new_identity();
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, kChunk - 1, kChunk, kChunk + 1,
                                 2 * kChunk, 3 * kChunk + 17}) {
    const std::string plain = plain_text(size);
    const std::string file = sealed(plain, to({&one, &two}));
    EXPECT_EQ(opened(file, keys_of(one)), plain) << size;
    EXPECT_EQ(opened(file, keys_of(two)), plain) << size;
    EXPECT_THAT(refusal(file, keys_of(three)), HasSubstr("sealed to others"));
    EXPECT_THAT(refusal(file, passphrase("a")), HasSubstr("sealed to keys, not by a passphrase"));
  }
}

TEST(AgeStream, Passphrase_OpensItAlone) {
  AgeRecipients by;
  by.passphrase = Secret(bytes_of("correct horse"));
  const std::string file = sealed("plain", by);
  EXPECT_EQ(opened(file, passphrase("correct horse")), "plain");
  EXPECT_THAT(refusal(file, passphrase("correct house")), HasSubstr("another passphrase"));
  EXPECT_THAT(refusal(file, AgeKeys()), HasSubstr("sealed by a passphrase"));
}

TEST(AgeStream, NothingPlain_IsInTheFile) {
  const Identity one = new_identity();
  const std::string word = "a name that nobody else has";
  EXPECT_EQ(sealed(word + plain_text(1000) + word, to({&one})).find(word.substr(0, 8)),
            std::string::npos);
}

TEST(AgeStream, EveryTruncation_IsRefused) {
  const Identity one = new_identity();
  const std::string file = sealed(plain_text(100), to({&one}));
  for (std::size_t size = 0; size < file.size(); ++size) {
    EXPECT_NE(refusal(file.substr(0, size), keys_of(one)), "opened") << size;
  }
  EXPECT_NE(refusal(file + "x", keys_of(one)), "opened");
  const std::string large = sealed(plain_text(2 * kChunk), to({&one}));
  const std::size_t chunk = kChunk + 16;
  EXPECT_THAT(refusal(large.substr(0, large.size() - chunk), keys_of(one)), HasSubstr("cut off"))
      << "a whole chunk less";
}

TEST(AgeStream, EveryBitFlip_IsRefused) {
  const Identity one = new_identity();
  const Identity two = new_identity();
  const std::string file = sealed(plain_text(100), to({&one, &two}));
  const AgeKeys keys = keys_of(two);
  for (std::size_t i = 0; i < file.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string wrong = file;
      wrong[i] = static_cast<char>(wrong[i] ^ (1 << bit));
      EXPECT_NE(refusal(wrong, keys), "opened") << i << ", bit " << bit;
    }
  }
}

TEST(AgeStream, ChunksExchangedDoubledOrMissing_AreRefused) {
  const Identity one = new_identity();
  const std::string file = sealed(plain_text(4 * kChunk - 5), to({&one}));
  const std::size_t start = age_header_size(file) + 16;
  const std::size_t chunk = kChunk + 16;
  const auto part = [&](std::size_t i) { return file.substr(start + i * chunk, chunk); };
  const std::string head = file.substr(0, start);
  ASSERT_EQ(refusal(head + part(0) + part(1) + part(2) + part(3), keys_of(one)), "opened");
  for (const std::string& wrong :
       {head + part(1) + part(0) + part(2) + part(3), head + part(0) + part(0) + part(2) + part(3),
        head + part(0) + part(2) + part(3), head + part(0) + part(1) + part(2),
        head + part(0) + part(1) + part(2) + part(3) + part(3)}) {
    EXPECT_NE(refusal(wrong, keys_of(one)), "opened");
  }
}

// From the second chunk on they are opened ahead, 32 at a time, on several threads.
TEST(AgeStream, ManyChunks_ComeInTheirOrder) {
  const Identity one = new_identity();
  for (const std::size_t size :
       {33 * kChunk - 1, 33 * kChunk, 33 * kChunk + 1, 65 * kChunk, 300 * kChunk + 17}) {
    const std::string plain = plain_text(size);
    EXPECT_TRUE(opened(sealed(plain, to({&one})), keys_of(one)) == plain) << size;
  }
}

TEST(AgeStream, DamageInAnyOfManyChunks_IsRefused) {
  const Identity one = new_identity();
  const std::string file = sealed(plain_text(140 * kChunk), to({&one}));
  const std::size_t start = age_header_size(file) + 16;
  const std::size_t chunk = kChunk + 16;
  for (const std::size_t i : {0, 1, 31, 32, 33, 64, 65, 66, 100, 138, 139}) {
    std::string wrong = file;
    wrong[start + i * chunk + 7] ^= 1;
    EXPECT_THAT(refusal(wrong, keys_of(one)), HasSubstr("chunk " + std::to_string(i))) << i;
    EXPECT_THAT(refusal(file.substr(0, start + i * chunk), keys_of(one)), HasSubstr("cut off"));
    EXPECT_NE(refusal(file.substr(0, start + i * chunk + 1), keys_of(one)), "opened") << i;
    wrong = file;
    wrong.erase(start + i * chunk, chunk);
    EXPECT_NE(refusal(wrong, keys_of(one)), "opened") << i;
  }
}

TEST(AgeStream, ReaderThatRefused_GivesNothingMore) {
  const Identity one = new_identity();
  for (const std::size_t chunks : {1, 100}) {
    std::string file = sealed(plain_text(chunks * kChunk), to({&one}));
    file.back() ^= 1;
    std::size_t at = 0;
    AgeReader reader(
        [&](std::span<std::uint8_t> buffer) {
          const std::size_t count = std::min(buffer.size(), file.size() - at);
          std::copy_n(file.begin() + static_cast<std::ptrdiff_t>(at), count, buffer.begin());
          at += count;
          return count;
        },
        keys_of(one), "a.sealed");
    std::vector<std::uint8_t> all(chunks * kChunk + 1);
    EXPECT_THROW(reader.read(all), DataError);
    EXPECT_THROW(reader.read(all), DataError) << "and not an end";
  }
}

TEST(AgeStream, SourceThatFails_IsToldToWhoeverReads) {
  const Identity one = new_identity();
  const std::string file = sealed(plain_text(100 * kChunk), to({&one}));
  std::size_t at = 0;
  AgeReader reader(
      [&](std::span<std::uint8_t> buffer) {
        if (at > 70 * kChunk) {
          throw EnvironmentError("a disk", "fails");
        }
        const std::size_t count = std::min(buffer.size(), file.size() - at);
        std::copy_n(file.begin() + static_cast<std::ptrdiff_t>(at), count, buffer.begin());
        at += count;
        return count;
      },
      keys_of(one), "a.sealed");
  std::vector<std::uint8_t> all(100 * kChunk);
  EXPECT_THROW(reader.read(all), EnvironmentError);
}

TEST(AgeStream, StanzaOfAnotherKind_IsPassedOver) {
  const Identity one = new_identity();
  EXPECT_THAT(refusal("age-encryption.org/v1\n-> ssh-ed25519 abc\nAAAA\n--- "
                      "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\n0123456789abcdef",
                      keys_of(one)),
              HasSubstr("sealed to others"));
}

TEST(AgeStream, ExpensiveScrypt_IsRefused) {
  const std::string start = "age-encryption.org/v1\n-> scrypt AAAAAAAAAAAAAAAAAAAAAA ";
  const std::string end =
      "\nAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\n--- "
      "AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA\n0123456789abcdef";
  for (const char* work : {"21", "40", "0", "018", "-1", "99999999999", "x"}) {
    EXPECT_THAT(refusal(start + work + end, passphrase("a")), HasSubstr("rounds")) << work;
  }
}

/// Files for and from Debian's age, in a folder that is gone after the test.
class AgeJudge : public ::testing::Test {
 protected:
  std::string place(const std::string& name) const { return (folder_ / name).string(); }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }
  std::string read(const std::string& name) const {
    std::ifstream file(folder_ / name, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), {}};
  }
  TemporaryDirectory folder_;
};

TEST_F(AgeJudge, SealedHere_AgeOpens) {
  ATELIER_NEEDS_PROGRAM("age");
  const Identity one = new_identity();
  const Identity two = new_identity();
  write("key", std::string(identity_text(two).text()));
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, kChunk, 3 * kChunk + 1}) {
    write("sealed", sealed(plain_text(size), to({&one, &two})));
    const ChildResult result =
        run_child({"age", "--decrypt", "-i", place("key"), "-o", place("plain"), place("sealed")});
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(read("plain"), plain_text(size));
  }
}

TEST_F(AgeJudge, SealedByAge_IsOpenedHere) {
  ATELIER_NEEDS_PROGRAM("age");
  ASSERT_EQ(run_child({"age-keygen", "-o", place("key")}).exit_code, 0);
  const std::vector<Identity> keys = read_identities(place("key"));
  const Identity other = new_identity();
  for (const std::size_t size : {std::size_t{0}, std::size_t{5}, kChunk, 3 * kChunk + 1}) {
    write("plain", plain_text(size));
    const ChildResult result =
        run_child({"age", "-r", recipient_text(other.recipient), "-r",
                   recipient_text(keys[0].recipient), "-o", place("sealed"), place("plain")});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_EQ(opened(read("sealed"), keys_of(keys[0])), plain_text(size));
    EXPECT_TRUE(is_sealed_file(place("sealed")));
    EXPECT_EQ(read_age_header(place("sealed")).stanzas.size(), 2U);
  }
}

// age asks for passphrases on a terminal, which script(1) gives it.
TEST_F(AgeJudge, Passphrases_WorkBothWays) {
  ATELIER_NEEDS_PROGRAM("age");
  ATELIER_NEEDS_PROGRAM("script");
  const auto with_terminal = [&](const std::string& command, const std::string& typed) {
    return run_child(
        {"sh", "-c",
         "(sleep 1; printf '" + typed + "'; sleep 4) | script -qec '" + command + "' /dev/null"});
  };
  AgeRecipients by;
  by.passphrase = Secret(bytes_of("correct horse"));
  write("sealed", sealed("plain", by));
  with_terminal("age -d -o " + place("plain") + " " + place("sealed"), "correct horse\\n");
  EXPECT_EQ(read("plain"), "plain");
  write("other", "another");
  with_terminal("age -p -o " + place("by_age") + " " + place("other"),
                "battery staple\\nbattery staple\\n");
  EXPECT_EQ(opened(read("by_age"), passphrase("battery staple")), "another");
}

}  // namespace
}  // namespace atelier::fixtures
