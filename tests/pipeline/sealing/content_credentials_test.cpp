// Content credentials of drawn images and films: what they say comes back, and what was changed is
// noticed, wherever it was.
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/mark/cyclic_checksum.h"
#include "core/mark/image_mark.h"
#include "core/seal/raw_signature.h"
#include "pipeline/sealing/cbor_items.h"
#include "pipeline/sealing/credentials_file.h"
#include "pipeline/sealing/jumbf_box.h"
#include "pipeline/sealing/signed_render.h"
#include "pipeline/sealing/signer_certificate.h"
#include "tests/support/outside_judge.h"
#include "tests/support/temporary_directory.h"

namespace atelier::fixtures {
namespace {

using ::testing::HasSubstr;

RenderStatement some_statement() {
  return {.tool = "atelier 0.1.0",
          .drawn = std::string(kDrawnByNetworks),
          .purpose = "research",
          .consent = {{.who = "P. Doe \"quoted\"", .scope = "research", .until = "2030-12-31"}},
          .made_of = {{"body", std::string(64, 'a')}, {"appearance", std::string(64, 'b')}}};
}

std::string some_png() {
  ByteImage image(40, 30, 3, 120);
  image.at(3, 4, 1) = 7;
  return image_bytes(image, ImageFormat::Png);
}

/// A JPEG as programs write it: with JFIF's segment.
std::string some_jpeg() {
  ByteImage image(40, 30, 3, 120);
  image.at(3, 4, 1) = 7;
  return image_bytes(image, ImageFormat::Jpeg);
}

/// Boxes as an MP4 has them, without a film.
std::string some_mp4() {
  return box_bytes("ftyp", "isom....") + box_bytes("free", std::string(50, 'm')) +
         box_bytes("mdat", std::string(99, 'd'));
}

/// Why the credentials of a file do not hold; "" where they do.
std::string problem_of(const std::string& bytes) {
  const auto store = stored_credentials(bytes, "a file");
  if (!store) {
    return "none";
  }
  const CredentialsFound found = read_credentials(*store, "a file");
  if (!found.problem.empty()) {
    return found.problem;
  }
  if (!found.binding || !found.signer || !found.statement) {
    return "not understood";
  }
  return bound_content(bytes, *found.binding, "a file") == found.binding->digest ? "" : "changed";
}

TEST(ContentCredentials, Png_SaysWhatItIs) {
  const SigningKey key = new_signing_key();
  const RenderStatement statement = some_statement();
  const std::string file = png_with_credentials(some_png(), statement, key);
  EXPECT_EQ(problem_of(some_png()), "none");
  EXPECT_EQ(problem_of(file), "");
  const CredentialsFound found = read_credentials(*stored_credentials(file, "a"), "a");
  EXPECT_EQ(found.generator, "atelier 0.1.0");
  EXPECT_EQ(found.source_type, "trainedAlgorithmicMedia");
  EXPECT_EQ(*found.signer, key.key);
  EXPECT_EQ(render_statement_text(*found.statement), render_statement_text(statement));
  // Other programs read it as before.
  const ByteImage image = read_byte_image(std::as_bytes(std::span(file)), "a.png");
  EXPECT_EQ(image.at(3, 4, 1), 7);
}

TEST(ContentCredentials, Mp4_SaysWhatItIs) {
  const SigningKey key = new_signing_key();
  const std::string film = some_mp4();
  const std::string file = film + mp4_credentials(film, some_statement(), key);
  EXPECT_EQ(problem_of(film), "none");
  EXPECT_EQ(problem_of(file), "");
  EXPECT_THROW(mp4_credentials("no film at all", some_statement(), key), DataError);
}

TEST(ContentCredentials, Jpeg_SaysWhatItIs) {
  const SigningKey key = new_signing_key();
  const std::string before = some_jpeg();
  ASSERT_THAT(before, HasSubstr("JFIF"));
  const std::string bare("\xFF\xD8\xFF\xD9", 4);
  for (const std::string& jpeg : {before, bare}) {
    const std::string file = jpeg_with_credentials(jpeg, some_statement(), key);
    EXPECT_EQ(problem_of(jpeg), "none");
    EXPECT_EQ(problem_of(file), "");
    EXPECT_EQ(problem_of(file + "x"), "changed");
  }
  const std::string file = jpeg_with_credentials(before, some_statement(), key);
  EXPECT_EQ(file.find("JFIF"), before.find("JFIF")) << "it has to be the first";
  EXPECT_EQ(read_byte_image(std::as_bytes(std::span(file)), "a.jpg").data,
            read_byte_image(std::as_bytes(std::span(before)), "b.jpg").data);
  EXPECT_THROW(jpeg_with_credentials(some_png(), some_statement(), key), DataError);
  EXPECT_THROW(jpeg_with_credentials("\xFF\xD8\xFF\xE0\xFF\xFF", some_statement(), key), DataError);
}

TEST(ContentCredentials, ManyConsents_AreInSeveralSegmentsOfAJpeg) {
  RenderStatement statement = some_statement();
  for (int i = 0; i < 2000; ++i) {
    statement.consent.push_back(
        {.who = "person " + std::to_string(i), .scope = "research", .until = "2030-12-31"});
  }
  const std::string file = jpeg_with_credentials(some_jpeg(), statement, new_signing_key());
  EXPECT_GT(file.size(), 130'000U);
  EXPECT_EQ(problem_of(file), "");
  EXPECT_NO_THROW(read_byte_image(std::as_bytes(std::span(file)), "a.jpg"));
}

TEST(ContentCredentials, Judge_FindsThemValid) {
  ATELIER_NEEDS_JUDGE("@trustnxt/c2pa-ts");
  const TemporaryDirectory folder;
  const SigningKey key = new_signing_key();
  const std::string png = png_with_credentials(some_png(), some_statement(), key);
  write_file_atomically(folder / "a.png", png);
  write_file_atomically(folder / "a.mp4",
                        some_mp4() + mp4_credentials(some_mp4(), some_statement(), key));
  write_file_atomically(folder / "a.jpg",
                        jpeg_with_credentials(some_jpeg(), some_statement(), key));
  for (const char* name : {"a.png", "a.jpg", "a.mp4"}) {
    EXPECT_EQ(judged("c2pa.mjs", {(folder / name).string()})["valid"], std::vector<double>{1})
        << name;
  }
  std::string changed = png;
  changed[changed.size() - 20] = static_cast<char>(changed[changed.size() - 20] ^ 1);
  write_file_atomically(folder / "changed.png", changed);
  EXPECT_EQ(judged("c2pa.mjs", {(folder / "changed.png").string()})["valid"],
            std::vector<double>{0});
}

TEST(ContentCredentials, AnyChangedBit_IsNoticed) {
  const SigningKey key = new_signing_key();
  for (const std::string& file :
       {png_with_credentials(some_png(), some_statement(), key),
        jpeg_with_credentials(some_jpeg(), some_statement(), key),
        some_mp4() + mp4_credentials(some_mp4(), some_statement(), key)}) {
    for (std::size_t at = 0; at < file.size(); ++at) {
      std::string changed = file;
      changed[at] = static_cast<char>(changed[at] ^ 1 << at % 8);
      try {
        const std::string problem = problem_of(changed);
        // A file's kind and ftyp are not bound, nor are headers of boxes that nobody reads, the
        // checksum of the chunk, or the certificate's words.
        if (problem.empty()) {
          const CredentialsFound found = read_credentials(*stored_credentials(changed, "a"), "a");
          EXPECT_EQ(render_statement_text(*found.statement),
                    render_statement_text(some_statement()))
              << at;
          EXPECT_EQ(found.source_type, "trainedAlgorithmicMedia") << at;
        }
      } catch (const DataError&) {
      }
    }
  }
}

TEST(ContentCredentials, Truncation_IsNoticed) {
  for (const std::string& file :
       {png_with_credentials(some_png(), some_statement(), new_signing_key()),
        jpeg_with_credentials(some_jpeg(), some_statement(), new_signing_key())}) {
    for (std::size_t size = 0; size < file.size(); ++size) {
      try {
        EXPECT_NE(problem_of(file.substr(0, size)), "") << size;
      } catch (const DataError&) {
      }
    }
  }
}

TEST(ContentCredentials, OtherStatementUnderTheOldSignature_IsNoticed) {
  const std::string file = png_with_credentials(some_png(), some_statement(), new_signing_key());
  std::string changed = file;
  const std::size_t at = changed.find("P. Doe");
  ASSERT_NE(at, std::string::npos);
  changed[at] = 'Q';
  EXPECT_THAT(problem_of(changed), HasSubstr("org.atelier.render"));
}

TEST(ContentCredentials, Jpeg_IsRead) {
  const std::string store = content_credentials(
      some_statement(), {.left_out_from = 2, .left_out = 10}, new_signing_key());
  // Two packets: the second has the header of the box again.
  const auto packet = [](char number, const std::string& content) {
    const std::size_t size = content.size() + 10;
    return std::string("\xFF\xEB", 2) + static_cast<char>(size >> 8) +
           static_cast<char>(size & 0xFF) + "JP" + std::string("\0\1\0\0\0", 5) + number + content;
  };
  const std::size_t cut = store.size() / 2;
  const std::string jpeg = std::string("\xFF\xD8", 2) + packet(1, store.substr(0, cut)) +
                           packet(2, store.substr(0, 8) + store.substr(cut)) +
                           std::string("\xFF\xD9", 2);
  EXPECT_EQ(stored_credentials(jpeg, "a.jpg"), store);
  EXPECT_THROW(stored_credentials(jpeg.substr(0, 40), "a.jpg"), DataError);
}

TEST(ContentCredentials, HostileBoxes_AreRefused) {
  const auto nested = [](int depth) {
    std::string boxes;
    for (int i = 0; i < depth; ++i) {
      boxes = superbox_bytes("c2pa", "c2pa", boxes);
    }
    return boxes;
  };
  EXPECT_NO_THROW(parse_jumbf(nested(4), "a"));
  EXPECT_THROW(parse_jumbf(nested(40), "a"), DataError);
  EXPECT_THROW(parse_jumbf("\x7F\xFF\xFF\xFFjumb", "a"), DataError);
  EXPECT_THROW(read_credentials(nested(1), "a"), DataError);
  EXPECT_THROW(CborItems(std::string(100'000, '\x81'), "a").skip(), DataError);
  EXPECT_THROW(CborItems("\xBB\xFF\xFF\xFF\xFF\xFF\xFF\xFF\xFF", "a").skip(), DataError);
  EXPECT_THROW(CborItems("\x9F", "a").skip(), DataError);
  EXPECT_THROW(parse_render_statement("{\"tool\": 3}", "a"), DataError);
  EXPECT_THROW(parse_render_statement("[1, 2", "a"), DataError);
}

TEST(SignerCertificate, Key_IsToldByIt) {
  for (int i = 0; i < 20; ++i) {
    const SigningKey key = new_signing_key();
    EXPECT_EQ(key_of_certificate(signer_certificate(key)), key.key);
  }
  EXPECT_EQ(key_of_certificate("no certificate"), std::nullopt);
}

TEST(RawSignature, OtherTextOrKey_IsNotSigned) {
  const SigningKey key = new_signing_key();
  const auto signature = sign_bytes(bytes_of("text"), key);
  EXPECT_TRUE(is_signature(signature, bytes_of("text"), key.key.key));
  EXPECT_FALSE(is_signature(signature, bytes_of("texx"), key.key.key));
  EXPECT_FALSE(is_signature(signature, bytes_of("text"), new_signing_key().key.key));
  EXPECT_FALSE(is_signature(bytes_of("short"), bytes_of("text"), key.key.key));
}

TEST(CyclicChecksum, KnownText_HasItsChecksum) {
  EXPECT_EQ(cyclic_checksum("123456789"), 0xCBF43926u);
  EXPECT_EQ(cyclic_checksum(""), 0u);
  EXPECT_NE(cyclic_checksum(std::string(8, '\0')), 0u);
}

TEST(SignedRender, ImageOfEitherFormat_HasMarkAndCredentials) {
  const TemporaryDirectory folder;
  const SignedRender render(some_statement(), new_signing_key());
  std::uint64_t bits = 0;
  for (const char* name : {"a.png", "a.jpg"}) {
    render.write(folder / name, Image(400, 400, 3, 0.4F));
    const auto found = find_mark(mark_brightness(read_byte_image(folder / name))).found;
    ASSERT_TRUE(found) << name;
    EXPECT_EQ(found->bits, mark_of(some_statement())) << name;
    EXPECT_EQ(problem_of(read_file_text(folder / name, 1 << 24)), "") << name;
    bits = found->bits;
  }
  RenderStatement other = some_statement();
  other.consent[0].until = "2030-12-30";
  EXPECT_NE(mark_of(other), bits);
}

TEST(SignedRender, KeyOfAFile_SignsOrFollowsFromTheStatement) {
  const TemporaryDirectory folder;
  const auto png = [](const SignedRender& render) {
    return render.png(render.marked(Image(64, 64, 3, 0.4F)));
  };
  const auto none = []() -> Secret { throw std::logic_error("no passphrase is needed"); };
  EXPECT_EQ(png(signed_render(some_statement(), "", none)),
            png(signed_render(some_statement(), "", none)));
  const SigningKey key = new_signing_key();
  write_file_atomically(folder / "key", signing_key_file(key).text());
  const std::string bytes = png(signed_render(some_statement(), (folder / "key").string(), none));
  const CredentialsFound found = read_credentials(*stored_credentials(bytes, "a.png"), "a.png");
  EXPECT_EQ(found.problem, "");
  EXPECT_EQ(found.signer->key, key.key.key);
}

}  // namespace
}  // namespace atelier::fixtures
