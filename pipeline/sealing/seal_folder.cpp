#include "pipeline/sealing/seal_folder.h"

#include "core/atomic_file.h"
#include "core/seal/age_stream.h"

namespace atelier {

SealedFolder seal_folder(const std::filesystem::path& folder, const SealingNote& note,
                         const AgeRecipients& to, const std::filesystem::path& out,
                         const std::function<bool()>& stop,
                         const std::function<void()>& before_commit) {
  SealedFolder done;
  AtomicFile file(out);
  AgeWriter sealed(to, [&](Bytes piece) {
    file.write(std::as_bytes(piece));
    done.bytes += static_cast<std::int64_t>(piece.size());
  });
  done.packed = pack_folder(
      folder, {kSealingNote, sealing_note_text(note)}, [&](Bytes piece) { sealed.write(piece); },
      stop);
  sealed.finish();
  if (!stop()) {
    before_commit();
    file.commit();
  }
  return done;
}

std::string sealed_to_text(const AgeRecipients& to, const std::string& purpose) {
  std::string who;
  for (const Recipient& one : to.recipients) {
    who += (who.empty() ? "" : ", ") + recipient_text(one);
  }
  return "for " + purpose + ", to " + (who.empty() ? "whoever knows the passphrase" : who);
}

}  // namespace atelier
