#include "pipeline/sealing/render_statement.h"

#include <nlohmann/json.hpp>

#include "core/error.h"
#include "core/sha256.h"
#include "core/store/build_info.h"

namespace atelier {

std::string drawing_tool() {
  const std::string build = build_info();
  return build.substr(0, build.find(','));
}

std::string render_statement_text(const RenderStatement& statement) {
  nlohmann::json consent = nlohmann::json::array();
  for (const Consent& one : statement.consent) {
    consent.push_back({{"who", one.who},
                       {"scope", one.scope},
                       {"until", one.until},
                       {"revocation", one.revocation},
                       {"key", one.key},
                       {"signature", one.signature}});
  }
  nlohmann::json made_of = nlohmann::json::array();
  for (const auto& [stage, digest] : statement.made_of) {
    made_of.push_back({{"stage", stage}, {"sha256", digest}});
  }
  return nlohmann::json({{"tool", statement.tool},
                         {"drawn", statement.drawn},
                         {"purpose", statement.purpose},
                         {"consent", consent},
                         {"made_of", made_of}})
      .dump();
}

RenderStatement parse_render_statement(std::string_view text, const std::string& file) {
  const auto refuse = [&](const std::string& found) {
    throw DataError(file, "statement of the render", found,
                    "as render --neural and animate write it");
  };
  const nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  RenderStatement statement;
  if (!json.is_object()) {
    refuse("no JSON");
  }
  const auto words = [&](const nlohmann::json& of, const char* name) {
    const auto found = of.find(name);
    if (found == of.end() || !found->is_string()) {
      refuse(std::string("no text '") + name + "'");
    }
    return found->get<std::string>();
  };
  const auto list = [&](const char* name) -> const nlohmann::json& {
    const auto found = json.find(name);
    if (found == json.end() || !found->is_array()) {
      refuse(std::string("no list '") + name + "'");
    }
    for (const nlohmann::json& one : *found) {
      if (!one.is_object()) {
        refuse(std::string("a wrong list '") + name + "'");
      }
    }
    return *found;
  };
  statement.tool = words(json, "tool");
  statement.drawn = words(json, "drawn");
  statement.purpose = words(json, "purpose");
  for (const nlohmann::json& one : list("consent")) {
    statement.consent.push_back({.who = words(one, "who"),
                                 .scope = words(one, "scope"),
                                 .until = words(one, "until"),
                                 .revocation = words(one, "revocation"),
                                 .key = words(one, "key"),
                                 .signature = words(one, "signature")});
  }
  for (const nlohmann::json& one : list("made_of")) {
    statement.made_of.emplace_back(words(one, "stage"), words(one, "sha256"));
  }
  return statement;
}

std::uint64_t mark_of(const RenderStatement& statement) {
  const Digest digest = sha256(render_statement_text(statement));
  std::uint64_t mark = 0;
  for (std::size_t i = 0; i < sizeof mark; ++i) {
    mark = mark << 8 | digest[i];
  }
  return mark;
}

std::string mark_text(std::uint64_t mark) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string text;
  for (int shift = 60; shift >= 0; shift -= 4) {
    text += kDigits[mark >> shift & 15];
  }
  return text;
}

}  // namespace atelier
