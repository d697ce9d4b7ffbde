#include "pipeline/sealing/signed_render.h"

#include <algorithm>
#include <cmath>

#include "core/atomic_file.h"
#include "core/error.h"
#include "core/io/file_bytes.h"
#include "core/io/image_file.h"
#include "core/quantity_text.h"
#include "core/saturating_cast.h"
#include "core/seal/raw_signature.h"
#include "pipeline/sealing/credentials_file.h"
#include "pipeline/sealing/video_limit.h"

namespace atelier {

SignedRender::SignedRender(RenderStatement statement, SigningKey key)
    : statement_(std::move(statement)), key_(std::move(key)), mark_(mark_of(statement_)) {}

ByteImage SignedRender::marked(const Image& image) const {
  ByteImage bytes = srgb_from_linear(image);
  for (std::size_t i = 3; image.channels == 4 && i < bytes.data.size(); i += 4) {
    bytes.data[i] = saturating_cast<std::uint8_t>(
        std::round(255.0F * std::clamp(image.data[i], 0.0F, 1.0F)));  // alpha is linear in files
  }
  mark_.add_to(bytes);
  return bytes;
}

std::string SignedRender::png(const ByteImage& marked) const {
  return png_with_credentials(image_bytes(marked, ImageFormat::Png), statement_, key_);
}

std::string SignedRender::jpeg(const ByteImage& marked) const {
  return jpeg_with_credentials(image_bytes(marked, ImageFormat::Jpeg), statement_, key_);
}

void SignedRender::write(const std::filesystem::path& path, const Image& image) const {
  const ByteImage bytes = marked(image);
  write_file_atomically(path,
                        image_format_of_name(path) == ImageFormat::Jpeg ? jpeg(bytes) : png(bytes));
}

std::string SignedRender::video_credentials(const std::filesystem::path& video) const {
  const auto size = static_cast<std::int64_t>(std::filesystem::file_size(video));
  if (size > kMaxVideoBytes) {  // the file's name is one for the time being
    throw DataError("", "video", bytes_text(static_cast<double>(size)) + " to be signed",
                    "at most " + bytes_text(static_cast<double>(kMaxVideoBytes)) +
                        ": fewer or smaller frames, or --mark false");
  }
  return mp4_credentials(read_file_text(video, kMaxVideoBytes), statement_, key_);
}

SignedRender signed_render(RenderStatement statement, const std::string& key_file,
                           const std::function<Secret()>& passphrase) {
  if (key_file.empty()) {
    SigningKey open = open_signing_key(render_statement_text(statement));
    return {std::move(statement), std::move(open)};
  }
  forbid_dumps();
  const Secret text = read_secret_file(key_file);
  const Secret words = asks_for_passphrase(text.text()) ? passphrase() : Secret();
  return {std::move(statement), parse_signing_key(text.text(), words, key_file)};
}

}  // namespace atelier
