#include "appearance/content_digest.h"

#include <functional>
#include <vector>

#include <gtest/gtest.h>

#include "core/archive_arrays.h"
#include "tests/support/refusals.h"

namespace atelier {
namespace {

using Tensors = std::map<std::string, Tensor>;
using Texts = std::map<std::string, std::string>;

const Tensors kTensors = {{"a", tensor_of(std::vector<float>{1, 2, 3, 4}, {2, 2})},
                          {"b", tensor_of(std::vector<int>{5, 6})}};
const Texts kTexts = {{"name", "dress"}, {"version", "2"}};

TEST(ContentDigest, AnyChange_ChangesTheDigest) {
  const std::string digest = content_digest(kTensors, kTexts);
  EXPECT_EQ(digest.size(), 64U);
  EXPECT_EQ(content_digest(Tensors(kTensors), Texts(kTexts)), digest);
  const std::vector<std::function<void(Tensors&, Texts&)>> changes = {
      [](auto& tensors, auto&) { tensors["a"].data[5] ^= std::byte{1}; },
      [](auto& tensors, auto&) {
        tensors["a"].shape = {4, 1};
      },
      [](auto& tensors, auto&) { tensors["b"].type = ElementType::Float32; },
      [](auto& tensors, auto&) { std::swap(tensors["a"], tensors["b"]); },
      [](auto& tensors, auto&) { tensors.erase("b"); },
      [](auto& tensors, auto&) { tensors["c"] = tensors["b"]; },
      [](auto&, auto& texts) { texts["name"] = "skirt"; },
      [](auto&, auto& texts) { texts.erase("version"); },
      [](auto&, auto& texts) {
        texts = {{"name", "dressv"}, {"ersion", "2"}};
      },
  };
  for (std::size_t i = 0; i < changes.size(); ++i) {
    Tensors tensors = kTensors;
    Texts texts = kTexts;
    changes[i](tensors, texts);
    EXPECT_NE(content_digest(tensors, texts), digest) << i;
  }
}

TEST(ContentDigest, TensorOfTexts_CountsItsStrings) {
  const auto of = [](const std::vector<std::string>& names) {
    return content_digest({{"id", tensor_of_texts(names)}}, {});
  };
  EXPECT_NE(of({"00", "01"}), of({"00", "02"}));
  EXPECT_NE(of({"ab", "c"}), of({"a", "bc"}));
}

TEST(ContentDigest, StoredDigest_IsNotPartOfItself) {
  Texts texts = kTexts;
  texts[kDigestText] = content_digest(kTensors, kTexts);
  EXPECT_EQ(content_digest(kTensors, texts), texts[kDigestText]);
  EXPECT_NO_THROW(require_digest(kTensors, texts, "x", "run it again"));
}

TEST(ContentDigest, FileWithoutDigest_IsAccepted) {
  EXPECT_NO_THROW(require_digest(kTensors, kTexts, "x", "run it again"));
}

TEST(ContentDigestRefused, FlippedBit_IsRefusedWithFileAndRemedy) {
  Texts texts = kTexts;
  texts[kDigestText] = content_digest(kTensors, kTexts);
  Tensors tensors = kTensors;
  tensors["b"].data[0] ^= std::byte{8};
  ATELIER_EXPECT_REFUSED(require_digest(tensors, texts, "x.safetensors", "run it again"), DataError,
                         "x.safetensors");
  ATELIER_EXPECT_REFUSED(require_digest(tensors, texts, "x", "run it again"), DataError,
                         "run it again");
  texts[kDigestText] = "none";
  ATELIER_EXPECT_REFUSED(require_digest(kTensors, texts, "x", ""), DataError, "damaged");
}

}  // namespace
}  // namespace atelier
