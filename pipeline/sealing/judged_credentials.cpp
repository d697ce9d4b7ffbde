#include "pipeline/sealing/judged_credentials.h"

#include "core/mark/image_mark.h"
#include "pipeline/sealing/credentials_file.h"

namespace atelier {

JudgedCredentials judge_credentials(const std::string& bytes, const std::string& file) {
  JudgedCredentials judged;
  const std::optional<std::string> store = stored_credentials(bytes, file);
  if (!store) {
    return judged;
  }
  judged.found = read_credentials(*store, file);
  judged.problem = judged.found->problem;
  if (!judged.problem.empty()) {
    return judged;
  }
  if (!judged.found->binding) {
    judged.problem = "how they are bound to the file is not understood";
  } else if (bound_content(bytes, *judged.found->binding, file) != judged.found->binding->digest) {
    judged.problem = "the file was changed since";
  } else if (!judged.found->signer) {
    judged.problem = "signed by another kind of key than Ed25519, which is not judged";
  }
  return judged;
}

std::string origin_text(const JudgedCredentials& judged, bool has_mark) {
  if (!judged.found) {
    return has_mark ? "synthetic, by its mark; no content credentials" : "nothing is known of it";
  }
  const CredentialsFound& found = *judged.found;
  const bool synthetic = found.source_type.find("lgorithmic") != std::string::npos;
  return std::string(synthetic ? "synthetic" : "not said to be synthetic") + " (" +
         (found.source_type.empty() ? "no source type" : found.source_type) + "), by " +
         found.generator;
}

std::string made_of_text(const RenderStatement& statement) {
  constexpr std::size_t kShown = 8;
  std::string text = statement.drawn;
  for (const auto& [stage, digest] : statement.made_of) {
    text += ", " + stage + " " + digest.substr(0, kShown);
  }
  return text;
}

std::string mark_line(const std::optional<FoundMark>& mark,
                      const std::optional<RenderStatement>& statement) {
  if (!mark) {
    return "none found";
  }
  const std::string text = mark_text(mark->bits);
  return !statement ? text + "; access.log of the workspace it was drawn from has it"
         : mark_of(*statement) == mark->bits ? text + ", that of the credentials"
                                             : text + ", which is not that of the credentials";
}

}  // namespace atelier
