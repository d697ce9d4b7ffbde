#include "core/io/safetensors.h"

#include <cstdlib>
#include <fstream>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_directory.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

Safetensors sample() {
  Safetensors content;
  content.metadata = {{"network", "shading"}, {"step", "120"}};
  content.tensors = {
      {"conv.weight", tensor_of(std::vector<float>{1, 2, 3, 4, 5, 6}, {2, 3})},
      {"conv.bias", tensor_of(std::vector<double>{0.5})},
      {"count", tensor_of(std::vector<std::int64_t>{7}, {})},
      {"mask", Tensor{ElementType::Bool, {3}, {std::byte{1}, std::byte{0}, std::byte{1}}, {}}},
      {"half", Tensor{ElementType::BFloat16, {1}, {std::byte{0}, std::byte{0x40}}, {}}},
      {"empty", Tensor{ElementType::Float32, {0, 4}, {}, {}}},
  };
  return content;
}

std::vector<std::byte> file_of(const std::string& header, std::size_t data_bytes) {
  std::vector<std::byte> bytes;
  for (int shift = 0; shift < 64; shift += 8) {
    bytes.push_back(static_cast<std::byte>(header.size() >> shift));
  }
  for (const char c : header) {
    bytes.push_back(static_cast<std::byte>(c));
  }
  bytes.resize(bytes.size() + data_bytes);
  return bytes;
}

std::string safetensors_refusal(const std::vector<std::byte>& bytes, const Limits& limits = {}) {
  try {
    parse_safetensors(bytes, "net.safetensors", limits);
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(Safetensors, WrittenTensors_ReadBackEqual) {
  const fixtures::TemporaryDirectory folder;
  write_safetensors(folder / "a.safetensors", sample());
  const Safetensors again = read_safetensors(folder / "a.safetensors");
  EXPECT_EQ(again.metadata, sample().metadata);
  ASSERT_EQ(again.tensors.size(), sample().tensors.size());
  for (const auto& [name, tensor] : sample().tensors) {
    EXPECT_EQ(again.tensors.at(name).type, tensor.type) << name;
    EXPECT_EQ(again.tensors.at(name).shape, tensor.shape) << name;
    EXPECT_EQ(again.tensors.at(name).data, tensor.data) << name;
  }
}

TEST(Safetensors, EmptyFile_RoundTrips) {
  EXPECT_TRUE(parse_safetensors(safetensors_bytes({})).tensors.empty());
}

TEST(Safetensors, SameContent_GivesIdenticalBytes) {
  EXPECT_EQ(safetensors_bytes(sample()), safetensors_bytes(sample()));
}

TEST(Safetensors, WrittenTensors_AreFoundByIndependentReader) {
  if (std::system("/usr/bin/python3 -c 'import numpy' 2>/dev/null") != 0) {
    GTEST_SKIP() << "no NumPy (python3-numpy)";
  }
  const fixtures::TemporaryDirectory folder;
  write_safetensors(folder / "a.safetensors", sample());
  std::ofstream(folder / "check.py") << "path = '" << (folder / "a.safetensors").string() << "'\n"
                                     << R"(
import json, struct, numpy as np
raw = open(path, 'rb').read()
n = struct.unpack('<Q', raw[:8])[0]
assert n % 8 == 0
header = json.loads(raw[8:8 + n])
assert header.pop('__metadata__') == {'network': 'shading', 'step': '120'}
types = {'F32': '<f4', 'F64': '<f8', 'I64': '<i8', 'BOOL': '?', 'BF16': '<u2'}
def tensor(name):
    e = header[name]
    begin, end = e['data_offsets']
    assert begin % np.dtype(types[e['dtype']]).itemsize == 0, 'not aligned'
    return np.frombuffer(raw[8 + n + begin:8 + n + end], types[e['dtype']]).reshape(e['shape'])
assert (tensor('conv.weight') == [[1, 2, 3], [4, 5, 6]]).all()
assert tensor('conv.bias')[0] == 0.5 and tensor('count') == 7
assert tensor('mask').tolist() == [True, False, True] and tensor('empty').shape == (0, 4)
ends = sorted(e['data_offsets'] for e in header.values())
assert ends[-1][1] == len(raw) - 8 - n
)";
  EXPECT_EQ(std::system(("/usr/bin/python3 " + (folder / "check.py").string()).c_str()), 0);
}

TEST(Safetensors, NonFiniteValues_AreLeftToTheCaller) {
  Safetensors content;
  content.tensors["w"] = tensor_of(std::vector<float>{1, std::numeric_limits<float>::infinity()});
  const Safetensors again = parse_safetensors(safetensors_bytes(content));
  EXPECT_THROW(check_finite(again.tensors.at("w"), "", "w"), DataError);
}

TEST(Safetensors, UnsupportedContent_ThrowsLogicError) {
  Safetensors content;
  content.tensors["t"] = Tensor{ElementType::Text, {1}, {}, {"x"}};
  EXPECT_THROW(safetensors_bytes(content), LogicError);
  content.tensors["t"] = Tensor{ElementType::Complex64, {0}, {}, {}};
  EXPECT_THROW(safetensors_bytes(content), LogicError);
  content.tensors.clear();
  content.tensors["__metadata__"] = tensor_of(std::vector<float>{1});
  EXPECT_THROW(safetensors_bytes(content), LogicError);
  content.tensors.clear();
  content.tensors["t"] = tensor_of(std::vector<float>{1});
  content.tensors["t"].shape = {2};
  EXPECT_THROW(safetensors_bytes(content), LogicError);
}

TEST(Safetensors, TooManyTensors_AreRefusedOnReadAndWrite) {
  std::string header = "{";
  for (int i = 0; i < 11; ++i) {
    header += (i > 0 ? "," : "") + std::string("\"") + std::to_string(i) +
              R"(":{"dtype":"U8","shape":[0],"data_offsets":[0,0]})";
  }
  Limits limits;
  limits.safetensors_entries = 10;
  EXPECT_THAT(safetensors_refusal(file_of(header + "}", 0), limits), HasSubstr("11 tensors"));
  EXPECT_EQ(safetensors_refusal(file_of(header + "}", 0)), "");
  Safetensors content;
  for (int i = 0; i <= 65'536; ++i) {
    content.tensors[std::to_string(i)] = Tensor{ElementType::UInt8, {0}, {}, {}};
  }
  EXPECT_THROW(safetensors_bytes(content), LogicError);
}

TEST(Safetensors, OversizedHeader_IsRefused) {
  EXPECT_THAT(safetensors_refusal(file_of("{" + std::string(1 << 20, ' ') + "}", 0)),
              HasSubstr("a header of 1048578 bytes"));
}

}  // namespace
}  // namespace atelier
