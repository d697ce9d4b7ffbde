// Signatures in minisign's format, both ways with Debian's minisign.
#include "core/seal/minisign.h"

#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

const std::string kText = "[[consent]]\nwho = \"P. Doe\"\n";

std::string refusal(const std::string& text, const std::string& signature,
                    const SignatureKey& key) {
  try {
    check_signature(text, signature, key, "a.minisig");
  } catch (const DataError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Minisign, OwnSignature_IsAccepted) {
  const SigningKey key = new_signing_key();
  const std::string signature = sign_text(kText, key, "a consent");
  EXPECT_EQ(check_signature(kText, signature, key.key, "a"), "a consent");
  EXPECT_EQ(parse_signature_key(signature_key_text(key.key), "k"), key.key);
  const Secret file = signing_key_file(key);
  EXPECT_FALSE(asks_for_passphrase(file.text()));
  const SigningKey again = parse_signing_key(file.text(), Secret(), "k");
  EXPECT_EQ(again.key, key.key);
  EXPECT_EQ(sign_text(kText, again, "a consent"), signature);
}

TEST(Minisign, OtherTextKeyOrComment_IsRefused) {
  const SigningKey key = new_signing_key();
  const std::string signature = sign_text(kText, key, "until 2030");
  EXPECT_THAT(refusal(kText + " ", signature, key.key), HasSubstr("not of this text"));
  EXPECT_THAT(refusal(kText, signature, new_signing_key().key), HasSubstr("by the key"));
  std::string later = signature;
  later.replace(later.find("2030"), 4, "2040");
  EXPECT_THAT(refusal(kText, later, key.key), HasSubstr("not of this text"));
}

TEST(Minisign, EveryTruncationAndBitFlip_IsRefused) {
  const SigningKey key = new_signing_key();
  const std::string signature = sign_text(kText, key, "a");
  const std::size_t trusted = signature.find('\n') + 1;  // the first line is nobody's
  for (std::size_t i = trusted; i + 1 < signature.size(); ++i) {
    EXPECT_NE(refusal(kText, signature.substr(0, i), key.key), "accepted") << i;
    for (int bit = 0; bit < 8; ++bit) {
      std::string wrong = signature;
      wrong[i] = static_cast<char>(wrong[i] ^ (1 << bit));
      EXPECT_NE(refusal(kText, wrong, key.key), "accepted") << i << ", bit " << bit;
    }
  }
}

TEST(Minisign, DamagedSecretKey_IsRefusedWithoutBeingShown) {
  const std::string good(signing_key_file(new_signing_key()).text());
  for (std::size_t i = good.find('\n') + 1; i + 1 < good.size(); ++i) {
    std::string wrong = good;
    wrong[i] = wrong[i] == 'B' ? 'C' : 'B';
    try {
      // A letter may be of the checksum, which has no use without a passphrase, or of the id.
      parse_signing_key(wrong, Secret(), "k");
    } catch (const DataError& error) {
      EXPECT_THAT(error.what(), Not(HasSubstr(good.substr(60, 8))));
    }
  }
  EXPECT_THROW(parse_signing_key(good.substr(0, good.size() / 2), Secret(), "k"), DataError);
  EXPECT_THROW(parse_signing_key("", Secret(), "k"), DataError);
}

class MinisignJudge : public ::testing::Test {
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

TEST_F(MinisignJudge, SignedHere_MinisignVerifies) {
  ATELIER_NEEDS_PROGRAM("minisign");
  const SigningKey key = new_signing_key();
  write("text", kText);
  write("text.minisig", sign_text(kText, key, "a consent"));
  const std::vector<std::string> verify = {
      "minisign", "-V", "-H", "-P", signature_key_text(key.key), "-m", place("text")};
  const ChildResult good = run_child(verify);
  EXPECT_EQ(good.exit_code, 0) << good.err;
  EXPECT_THAT(good.out, HasSubstr("Trusted comment: a consent"));
  write("text", kText + "x");
  EXPECT_NE(run_child(verify).exit_code, 0);
}

TEST_F(MinisignJudge, SignedByMinisign_IsAcceptedHere) {
  ATELIER_NEEDS_PROGRAM("minisign");
  write("text", kText);
  ASSERT_EQ(
      run_child({"minisign", "-G", "-W", "-p", place("k.pub"), "-s", place("k.key")}).exit_code, 0);
  const SignatureKey key = parse_signature_key(read("k.pub"), "k.pub");
  for (const std::string& way : {std::string("-H"), std::string("-l")}) {
    std::vector<std::string> sign = {"minisign", "-S", "-s", place("k.key"), "-m", place("text")};
    if (way == "-l") {  // the way of hashing before 2022
      sign.insert(sign.begin() + 1, way);
    }
    ASSERT_EQ(run_child(sign).exit_code, 0);
    EXPECT_THAT(check_signature(kText, read("text.minisig"), key, "s"), HasSubstr("file:text"));
    EXPECT_THAT(refusal("x", read("text.minisig"), key), HasSubstr("not of this text"));
  }
  std::string id = key_id_text(key.id);
  id.erase(0, id.find_first_not_of('0'));  // minisign writes none of the zeros before
  EXPECT_THAT(read("k.pub"), HasSubstr(id));
  EXPECT_EQ(parse_signing_key(read("k.key"), Secret(), "k.key").key, key);
}

TEST_F(MinisignJudge, KeyOfAtelier_SignsWithMinisign) {
  ATELIER_NEEDS_PROGRAM("minisign");
  const SigningKey key = new_signing_key();
  write("k.key", std::string(signing_key_file(key).text()));
  write("text", kText);
  const ChildResult signed_there =
      run_child({"minisign", "-S", "-s", place("k.key"), "-m", place("text"), "-t", "there"});
  ASSERT_EQ(signed_there.exit_code, 0) << signed_there.err;
  EXPECT_EQ(check_signature(kText, read("text.minisig"), key.key, "s"), "there");
}

}  // namespace
}  // namespace atelier::fixtures
