#include "apps/commands/seal_keys.h"

#include <array>
#include <csignal>
#include <iterator>
#include <string_view>
#include <utility>

#include <fcntl.h>
#include <sodium.h>
#include <termios.h>
#include <unistd.h>

#include "apps/console/arguments.h"
#include "core/usage_error.h"

namespace atelier {
namespace {

constexpr std::size_t kMaxPassphrase = 1024;

constexpr std::array<int, 4> kEnding = {SIGINT, SIGTERM, SIGHUP, SIGQUIT};
volatile std::sig_atomic_t signal_at_prompt = 0;

/// The terminal of the process with its echo switched off, and as it was in the end. A signal that
/// would end the process meanwhile does so then, so that no terminal stays silent.
class QuietTerminal {
 public:
  QuietTerminal() : file_(open("/dev/tty", O_RDWR | O_NOCTTY | O_CLOEXEC)) {
    if (file_ < 0 || tcgetattr(file_, &before_) != 0) {
      if (file_ >= 0) {
        close(file_);
      }
      throw UsageError(
          "a passphrase is asked for on a terminal, and there is none; give "
          "--passphrase-file FILE");
    }
    termios quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    struct sigaction note {};  // without SA_RESTART: it ends what is read
    note.sa_handler = [](int signal) { signal_at_prompt = signal; };
    for (std::size_t i = 0; i < kEnding.size(); ++i) {
      sigaction(kEnding[i], &note, &handlers_[i]);
    }
    tcsetattr(file_, TCSAFLUSH, &quiet);
  }
  ~QuietTerminal() {
    tcsetattr(file_, TCSAFLUSH, &before_);
    close(file_);
    for (std::size_t i = 0; i < kEnding.size(); ++i) {
      sigaction(kEnding[i], &handlers_[i], nullptr);
    }
    if (signal_at_prompt != 0) {
      raise(std::exchange(signal_at_prompt, 0));
    }
  }
  QuietTerminal(const QuietTerminal&) = delete;
  QuietTerminal& operator=(const QuietTerminal&) = delete;

  void say(std::string_view text) const {
    [[maybe_unused]] const ssize_t shown = write(file_, text.data(), text.size());
  }
  Secret line() const {
    Secret typed(kMaxPassphrase);
    std::size_t size = 0;
    std::uint8_t letter = 0;
    while (signal_at_prompt == 0 && read(file_, &letter, 1) == 1 && letter != '\n') {
      if (size == kMaxPassphrase) {
        throw UsageError("a passphrase has at most 1024 bytes");
      }
      typed.data()[size++] = letter;
    }
    say("\n");
    return Secret(typed.bytes().first(size));
  }

 private:
  int file_;
  termios before_{};
  std::array<struct sigaction, kEnding.size()> handlers_{};
};

Secret ask_passphrase(bool confirm) {
  const QuietTerminal terminal;
  terminal.say("passphrase: ");
  Secret typed = terminal.line();
  if (typed.size() == 0 || signal_at_prompt != 0) {
    throw UsageError("no passphrase was typed");
  }
  if (confirm) {
    terminal.say("the same again: ");
    const Secret again = terminal.line();
    if (again.size() != typed.size() ||
        sodium_memcmp(again.data(), typed.data(), typed.size()) != 0) {
      throw UsageError("the two passphrases differ");
    }
  }
  return typed;
}

}  // namespace

void add_key_arguments(CLI::App& parser, KeyArguments& arguments) {
  add_option(parser, "--identity", arguments.identities,
             "Secret key of one to whom the file is sealed, as atelier key or age-keygen writes it")
      .type_name("FILE")
      .once_a_flag();
  add_option(parser, "--passphrase-file", arguments.passphrase_file,
             "File whose first line is the passphrase")
      .type_name("FILE");
  add_flag(parser, "--passphrase", arguments.passphrase, "Passphrase asked for on the terminal");
}

Secret passphrase_of(const std::string& file, bool confirm) {
  return file.empty() ? ask_passphrase(confirm) : read_passphrase(file);
}

AgeKeys read_keys(const KeyArguments& arguments) {
  if (!arguments.any()) {
    throw UsageError(
        "a sealed file is opened with --identity FILE, --passphrase-file FILE or "
        "--passphrase");
  }
  forbid_dumps();
  AgeKeys keys;
  for (const std::string& file : arguments.identities) {
    std::vector<Identity> more = read_identities(file);
    keys.identities.insert(keys.identities.end(), std::make_move_iterator(more.begin()),
                           std::make_move_iterator(more.end()));
  }
  if (arguments.passphrase || !arguments.passphrase_file.empty()) {
    keys.passphrase = passphrase_of(arguments.passphrase_file, false);
  }
  return keys;
}

}  // namespace atelier
