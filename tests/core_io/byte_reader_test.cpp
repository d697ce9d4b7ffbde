#include "core/io/byte_reader.h"

#include <array>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/error.h"

namespace atelier {
namespace {

using ::testing::HasSubstr;

constexpr std::array<unsigned char, 8> kRaw = {1, 2, 3, 4, 5, 6, 7, 8};
const std::span<const std::byte> kBytes = std::as_bytes(std::span(kRaw));

template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const DataError& error) {
    return error.what();
  }
  return "";
}

TEST(ByteReader, BothByteOrders_AreRead) {
  ByteReader reader(kBytes, "x");
  EXPECT_EQ(reader.little<std::uint16_t>("a"), 0x0201);
  EXPECT_EQ(reader.big<std::uint16_t>("b"), 0x0304);
  EXPECT_EQ(reader.big<std::uint32_t>("c"), 0x05060708u);
  EXPECT_EQ(reader.remaining(), 0u);
}

TEST(ByteReader, Floats_AreReadInBothByteOrders) {
  const std::array<unsigned char, 8> raw = {0, 0, 0x80, 0x3F, 0x3F, 0x80, 0, 0};
  ByteReader reader(std::as_bytes(std::span(raw)), "x");
  EXPECT_EQ(reader.little<float>("a"), 1.0f);
  EXPECT_EQ(reader.big<float>("b"), 1.0f);
}

TEST(ByteReader, TextAndSeek_Work) {
  const std::string text = "hello world";
  ByteReader reader(std::as_bytes(std::span(text)), "x");
  EXPECT_EQ(reader.text(5, "word"), "hello");
  reader.seek(6, "word");
  EXPECT_EQ(reader.text(5, "word"), "world");
  EXPECT_EQ(reader.position(), 11u);
}

TEST(ByteReader, ReadPastEnd_IsRefusedWithPlace) {
  ByteReader reader(kBytes, "mesh.bin");
  reader.skip(6, "header");
  const std::string what = refusal([&] { reader.little<std::uint32_t>("vertex count"); });
  EXPECT_THAT(what, HasSubstr("mesh.bin: byte 6"));
  EXPECT_THAT(what, HasSubstr("vertex count"));
  EXPECT_THAT(what, HasSubstr("2 bytes left"));
  EXPECT_EQ(reader.little<std::uint16_t>("still here"), 0x0807);
}

TEST(ByteReader, CountBeyondRemainingBytes_IsRefused) {
  ByteReader reader(kBytes, "x");
  EXPECT_EQ(reader.paid(2, 4, "faces"), 2u);
  EXPECT_THAT(refusal([&] { reader.paid(3, 4, "faces"); }), HasSubstr("a count of 3 faces"));
  EXPECT_THAT(refusal([&] { reader.paid(std::numeric_limits<std::uint64_t>::max(), 1, "faces"); }),
              HasSubstr("with 8 bytes left"));
  EXPECT_THROW(reader.paid(1, 0, "faces"), LogicError);
}

TEST(ByteReader, SeekPastEnd_IsRefused) {
  ByteReader reader(kBytes, "x");
  EXPECT_NO_THROW(reader.seek(8, "block"));
  EXPECT_THAT(refusal([&] { reader.seek(9, "block"); }), HasSubstr("beyond the end"));
  EXPECT_THAT(refusal([&] { reader.seek(std::numeric_limits<std::uint64_t>::max(), "block"); }),
              HasSubstr("beyond the end"));
}

TEST(ByteReader, HugeTake_IsRefused) {
  ByteReader reader(kBytes, "x");
  EXPECT_THROW(reader.take(std::numeric_limits<std::size_t>::max(), "all"), DataError);
}

}  // namespace
}  // namespace atelier
