#include "core/sha256.h"

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/error.h"
#include "core/random.h"

namespace atelier {
namespace {

class Sha256Vectors : public testing::TestWithParam<Sha256::Code> {
 protected:
  static std::string digest_of(const std::string& bytes) {
    Sha256 hash(GetParam());
    hash.update(bytes);
    return hex(hash.finish());
  }
};

INSTANTIATE_TEST_SUITE_P(Codes, Sha256Vectors,
                         testing::Values(Sha256::Code::Best, Sha256::Code::Scalar),
                         [](const testing::TestParamInfo<Sha256::Code>& code) {
                           return code.param == Sha256::Code::Best ? "Best" : "Scalar";
                         });

// FIPS 180-2, appendix B, and the NIST example "SHA256.pdf".
TEST_P(Sha256Vectors, EmptyMessage_MatchesStandard) {
  EXPECT_EQ(digest_of(""), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
}

TEST_P(Sha256Vectors, OneBlock_MatchesStandard) {
  EXPECT_EQ(digest_of("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

TEST_P(Sha256Vectors, TwoBlocks_MatchStandard) {
  EXPECT_EQ(digest_of("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq"),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST_P(Sha256Vectors, FourBlocks_MatchStandard) {
  EXPECT_EQ(digest_of("abcdefghbcdefghicdefghijdefghijkefghijklfghijklmghijklmnhijklmno"
                      "ijklmnopjklmnopqklmnopqrlmnopqrsmnopqrstnopqrstu"),
            "cf5b16a778af8380036ce59e7b0492370b249b11e8f07a51afac45037afee9d1");
}

TEST_P(Sha256Vectors, MillionLettersA_MatchStandard) {
  EXPECT_EQ(digest_of(std::string(1'000'000, 'a')),
            "cdc76e5c9914fb9281a1c7e284d73e67f1809a48a497200e046d39ccc7112cd0");
}

// NIST CAVP SHA256ShortMsg.rsp, Len = 8 and Len = 512.
TEST_P(Sha256Vectors, OneByte_MatchesStandard) {
  EXPECT_EQ(digest_of("\xd3"), "28969cdfa74a12c82f3bad960b0b000aca2ac329deea5c2328ebc6f2ba9802c1");
}

TEST_P(Sha256Vectors, LengthsAroundBlockSize_MatchStandard) {
  // The padding needs one more block from 56 bytes on; 55, 56, 63, 64 zeros are the edges.
  EXPECT_EQ(digest_of(std::string(55, '\0')),
            "02779466cdec163811d078815c633f21901413081449002f24aa3e80f0b88ef7");
  EXPECT_EQ(digest_of(std::string(56, '\0')),
            "d4817aa5497628e7c77e6b606107042bbba3130888c5f47a375e6179be789fbb");
  EXPECT_EQ(digest_of(std::string(64, '\0')),
            "f5a5fd42d16a20302798ef6ed309979b43003d2320d9f0e8ea9831a92759fb4b");
}

TEST_P(Sha256Vectors, AnySplit_GivesTheSameDigest) {
  Random random{7, 0, 0};
  std::string bytes(1000, '\0');
  std::generate(bytes.begin(), bytes.end(),
                [&] { return static_cast<char>(uniform_index(random, 256)); });
  const Digest whole = sha256(bytes);
  for (int trial = 0; trial < 200; ++trial) {
    Sha256 hash(GetParam());
    std::size_t at = 0;
    while (at < bytes.size()) {
      const std::size_t step =
          std::min<std::size_t>(bytes.size() - at, uniform_index(random, trial % 3 == 0 ? 5 : 150));
      hash.update(bytes.data() + at, step);
      at += step;
    }
    EXPECT_EQ(hash.finish(), whole);
  }
}

TEST(Sha256, ScalarAndBestCode_AgreeOnEveryLength) {
  std::string bytes;
  for (int length = 0; length < 300; ++length) {
    Sha256 best(Sha256::Code::Best);
    Sha256 scalar(Sha256::Code::Scalar);
    best.update(bytes);
    scalar.update(bytes);
    EXPECT_EQ(best.finish(), scalar.finish()) << length << " bytes";
    bytes += static_cast<char>(length * 37 + 11);
  }
}

TEST(Sha256, NullPointerWithZeroBytes_IsAccepted) {
  Sha256 hash;
  hash.update(nullptr, 0);
  EXPECT_EQ(hash.finish(), sha256(""));
}

TEST(Sha256, UpdateAfterFinish_IsRefused) {
  Sha256 hash;
  hash.finish();
  EXPECT_THROW(hash.update("x", 1), LogicError);
}

TEST(Sha256, SecondFinish_IsRefused) {
  Sha256 hash;
  hash.finish();
  EXPECT_THROW(hash.finish(), LogicError);
}

TEST(Sha256, Hex_RoundTrips) {
  const Digest digest = sha256("abc");
  EXPECT_EQ(digest_from_hex(hex(digest)), digest);
}

TEST(Sha256, MalformedHex_IsRefused) {
  const std::string good = hex(sha256("abc"));
  EXPECT_FALSE(digest_from_hex(""));
  EXPECT_FALSE(digest_from_hex(good.substr(1)));
  EXPECT_FALSE(digest_from_hex(good + "0"));
  std::string upper = good;
  upper[0] = 'B';
  EXPECT_FALSE(digest_from_hex(upper));
  for (const char bad : {'g', ' ', '/', ':', '`', '\0', '-'}) {
    std::string text = good;
    text[40] = bad;
    EXPECT_FALSE(digest_from_hex(text)) << "with " << bad;
  }
}

}  // namespace
}  // namespace atelier
