#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <iostream>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "apps/console/command.h"
#include "apps/console/stage_command.h"
#include "apps/console/stand_alone.h"
#include "bodymodel/retarget/synthetic_motion.h"
#include "capture/layouts/write_layout.h"
#include "core/exit_code.h"
#include "core/usage_error.h"
#include "pipeline/chain/run_chain.h"
#include "pipeline/evaluation/evaluation.h"
#include "pipeline/pictures/animation_pictures.h"
#include "pipeline/stages/stages.h"
#include "simulation/material/fabric.h"

namespace atelier {
namespace {

std::string joined(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) {
    text += (text.empty() ? "" : " ") + name;
  }
  return text;
}

std::string drafted_bodies() {
  return "female male";
}

/// With what is none of the two: the mean, and one that is drawn.
std::string bodies_or_default() {
  return "default " + drafted_bodies();
}

std::string bodies_or_random() {
  return "random " + drafted_bodies();
}

std::string motions() {
  return joined(procedural_motions());
}

std::string motions_or_auto() {
  return "auto " + motions();
}

std::string drafted_garments() {
  return "dress skirt tee trousers";
}

/// With those that are worn together, which are one word for the shell.
std::string drafted_outfits() {
  return drafted_garments() + " tee+trousers tee+skirt";
}

std::string outfits_or_own() {
  return "auto none " + drafted_outfits();
}

std::string views() {
  return joined(animation_views());
}

std::string fabrics() {
  return joined(fabric_names());
}

std::string layouts() {
  return joined(layout_names());
}

std::string stages_with_figures() {
  return joined(evaluated_stages());
}

/// The files that an argument takes, by their extensions, and the names.
struct FileArgument {
  std::string_view command;          ///< "" for every one
  std::string_view flag;             ///< "" for what is given without a flag
  std::string_view extensions;       ///< with a space between them; "": no files
  std::string (*names)() = nullptr;  ///< with a space between them; null: files alone
};

constexpr std::array kFileArguments = {
    FileArgument{"", "--config", "toml"},
    FileArgument{"convert", "", "obj ply glb gltf fbx"},
    FileArgument{"render", "", "obj ply glb gltf fbx"},
    FileArgument{"render", "--out", "png jpg tif webp avif"},
    FileArgument{"body-model", "", "npz glb gltf fbx obj bvh amc trc c3d", bodies_or_default},
    FileArgument{"body-model", "--target", "target"},
    FileArgument{"simulate", "--garment", "obj ply glb gltf fbx"},
    FileArgument{"simulate", "--body", "obj ply glb gltf fbx npz h5", drafted_bodies},
    FileArgument{"simulate", "--motion", "bvh amc npz trc c3d glb gltf fbx"},
    FileArgument{"run", "--material", "", fabrics},
    FileArgument{"simulate", "--material", "", fabrics},
    FileArgument{"drape", "--garment", "json", drafted_garments},
    FileArgument{"drape", "--body", "npz glb gltf fbx obj", drafted_bodies},
    FileArgument{"personalize", "--body", "npz glb gltf fbx obj", bodies_or_default},
    FileArgument{"animate", "--body", "npz glb gltf fbx obj", drafted_bodies},
    FileArgument{"animate", "--motion", "bvh amc npz trc c3d glb gltf fbx", motions},
    FileArgument{"animate", "--camera", "", views},
    FileArgument{"animate", "--garment", "json", outfits_or_own},
    FileArgument{"synthesize", "--garment", "json", drafted_outfits},
    FileArgument{"synthesize", "--body", "npz glb gltf fbx obj", bodies_or_random},
    FileArgument{"synthesize", "--motion", "bvh amc npz trc c3d glb gltf fbx", motions_or_auto},
    FileArgument{"synthesize", "--layout", "", layouts},
    FileArgument{"evaluate", "--stage", "", stages_with_figures},
    FileArgument{"convert-capture", "--cameras", "json"},
    FileArgument{"calibrate", "--lenses", "json toml yml"},
    FileArgument{"calibrate-color", "--out", "json"},
    FileArgument{"detect", "--model", "onnx"},
    FileArgument{"validate", "--html", "html"},
    FileArgument{"report", "--out", "html"},
};

/// Of `run` the stages of its chain, of every other command all there are.
std::string stage_names([[maybe_unused]] std::string_view command) {
  std::string names;
  const auto add = [&](std::string_view name) {
    names += (names.empty() ? "" : " ") + std::string(name);
  };
  if (command == "run") {
    for (const StageRow* step : run_steps()) {
      add(step->stage.name);
    }
    return names;
  }
  for (const Stage& stage : all_stages()) {
    add(stage.name);
  }
  return names;
}

/// "cpu cuda" of an option whose type is "cpu|cuda", "cpu" of a stage without a twin, the stages
/// that the command knows of one that takes a STAGE; "" of one that takes anything else.
std::string choices_of(std::string_view command, const CLI::Option& option) {
  std::string words = option.get_type_name();
  if (words == "STAGE") {
    return stage_names(command);
  }
  if (words == "cpu") {
    return words;
  }
  if (words.find('|') == std::string::npos ||
      words.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789_.-|") != std::string::npos) {
    return "";
  }
  std::replace(words.begin(), words.end(), '|', ' ');
  return words;
}

/// The declarations of a command, for the shell:
///     gc) words='--help --dry-run --json'
///       case $before in
///         --device) values='cpu cuda' ;;
///       esac ;;
std::string command_case(std::string_view name, const CLI::App& parser) {
  std::string words = "--help";
  std::string values;
  const auto answer = [&](const std::string& before, const std::string& what,
                          std::string_view choices) {
    values += "        " + before + ") " + what + "='" + std::string(choices) + "' ;;\n";
  };
  for (const CLI::Option* option : parser.get_options()) {
    if (option->get_group().empty()) {
      continue;  // not listed in the help either
    }
    const std::string choices = choices_of(name, *option);
    for (const std::string& flag : option->get_lnames()) {
      words += flag == "help" ? "" : " --" + flag;
      if (!choices.empty()) {  // "--layout" may be typed for "--capture.layout"
        constexpr std::string_view kSection = "capture.";
        const std::string word = flag.starts_with(kSection) ? flag.substr(kSection.size()) : flag;
        const bool both = word != flag && parser.get_option_no_throw("--" + word) == nullptr;
        answer("--" + flag + (both ? "|--" + word : ""), "values", choices);
      }
    }
    if (option->get_positional() && !choices.empty()) {
      answer(std::string(name), "values", choices);
    }
  }
  std::string rest;
  for (const FileArgument& file : kFileArguments) {
    if (file.command == name ||
        (file.command.empty() && parser.get_option_no_throw(std::string(file.flag)) != nullptr)) {
      std::string& answers = file.flag.empty() ? rest : values;
      answers += "        " + (file.flag.empty() ? "*" : std::string(file.flag)) + ")";
      answers += file.names == nullptr ? "" : " values='" + file.names() + "'";
      answers += file.extensions.empty() ? "" : " files='" + std::string(file.extensions) + "'";
      answers += " ;;\n";
    }
  }
  return "    " + std::string(name) + ") words='" + words + "'" +
         (values.empty() && rest.empty()
              ? std::string(" ;;\n")
              : "\n      case $before in\n" + values + rest + "      esac ;;\n");
}

// Bash splits "--flag=value" at the "=". Flags may be typed with "_" for "-". Where the kind of
// file is known, folders lead to it. Names of files come line by line: they may have spaces.
constexpr const char* kReply =
    "  case ${COMP_WORDS[1]}:$word in\n"
    "    completion:*) COMPREPLY=($(compgen -W 'bash' -- \"$word\")) ;;\n"
    "    *:-*) COMPREPLY=($(compgen -W \"$words\" -- \"$word\")) ;;\n"
    "    *)\n"
    "      COMPREPLY=()\n"
    "      if [ -n \"$values\" ]; then\n"
    "        COMPREPLY=($(compgen -W \"$values\" -- \"$word\"))\n"
    "      fi\n"
    "      if [ -n \"$files\" ]; then\n"
    "        local kind\n"
    "        mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -d -- \"$word\")\n"
    "        for kind in $files; do\n"
    "          mapfile -t -O ${#COMPREPLY[@]} COMPREPLY < <(compgen -f -X \"!*.$kind\" -- "
    "\"$word\")\n"
    "        done\n"
    "      elif [ -z \"$values\" ]; then\n"
    "        mapfile -t COMPREPLY < <(compgen -f -- \"$word\")\n"
    "      fi ;;\n"
    "  esac\n";

std::string bash_script() {
  std::string commands;
  std::string cases;
  const auto add = [&](std::string_view name, const CLI::App& parser) {
    commands += (commands.empty() ? "" : " ") + std::string(name);
    cases += command_case(name, parser);
  };
  for (const Stage& stage : all_stages()) {
    CLI::App parser;
    add_stage(parser, stage, stand_alone(stage.name));
    add(stage.name, parser);
  }
  for (const Command& command : all_commands()) {
    CLI::App parser;
    if (command.name != "completion") {  // which would ask itself without end
      command.add(parser);
    }
    add(command.name, parser);
  }
  return "# Completion for bash: source <(atelier completion bash)\n"
         "_atelier() {\n"
         "  local word=${COMP_WORDS[COMP_CWORD]} before=${COMP_WORDS[COMP_CWORD-1]}\n"
         "  local words= values= files=\n"
         "  if [ \"$COMP_CWORD\" -eq 1 ]; then\n"
         "    COMPREPLY=($(compgen -W '" +
         commands +
         " --help --version' -- \"$word\"))\n"
         "    return\n"
         "  fi\n"
         "  if [ \"$word\" = = ]; then\n"
         "    word=\n"
         "  elif [ \"$before\" = = ]; then\n"
         "    before=${COMP_WORDS[COMP_CWORD-2]}\n"
         "  fi\n"
         "  before=${before//_/-}\n"
         "  case ${COMP_WORDS[1]} in\n"
         "    help) values='" +
         commands + "' ;;\n" + cases + "  esac\n" + kReply +
         "}\n"
         "complete -o filenames -F _atelier atelier\n";
}

int run(const std::string& shell) {
  if (shell != "bash") {
    throw UsageError(
        "completion takes the name of a shell, of which there is bash: atelier completion bash");
  }
  std::cout << bash_script();
  return kExitDone;
}

}  // namespace

Action add_completion(CLI::App& parser) {
  auto shell = std::make_shared<std::string>();
  parser.add_option("SHELL", *shell, "bash");
  return [shell] { return run(*shell); };
}

}  // namespace atelier
