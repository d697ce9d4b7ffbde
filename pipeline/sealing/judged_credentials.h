#pragma once

#include <optional>
#include <string>

#include "core/mark/image_mark.h"
#include "pipeline/sealing/content_credentials.h"
#include "pipeline/sealing/render_statement.h"

namespace atelier {

/// What the credentials of a file say, and why they do not hold; "" where they do.
struct JudgedCredentials {
  std::optional<CredentialsFound> found;
  std::string problem;
};

/// Of the bytes of a PNG, JPEG or MP4. Throws DataError as stored_credentials and read_credentials.
JudgedCredentials judge_credentials(const std::string& bytes, const std::string& file);

/// A line on where a picture comes from, by its credentials or else its mark.
std::string origin_text(const JudgedCredentials& judged, bool has_mark);

/// A line on what was drawn and of which results.
std::string made_of_text(const RenderStatement& statement);

/// A line on the mark that was found and whether it is that of the credentials.
std::string mark_line(const std::optional<FoundMark>& mark,
                      const std::optional<RenderStatement>& statement);

}  // namespace atelier
