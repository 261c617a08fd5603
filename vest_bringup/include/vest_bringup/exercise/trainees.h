#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "vest_bringup/exercise/engine.h"

struct sqlite3;

namespace vest::exercise {

/// The database cannot do what was asked; what() is one message with file, cause and what to do.
class DatabaseError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Now as results have it: UTC, ISO 8601, such as 2026-11-23T16:00:00Z.
std::string dateNow();

/// A result as it is kept.
struct Attempt {
  std::string trainee, date;  ///< pseudonym; UTC, ISO 8601
  std::string exercise, exercise_hash, input_hash, version, directory;
  double total = 0, quality = 0, time = 0;
  bool passed = false;
  std::string flags;  ///< words, separated by commas; `copy` where the same input was handed in before
  std::string json;   ///< toJson() of the result
};

/// @param date UTC, ISO 8601  @param version of VEST  @param directory of the recording; may be empty
Attempt attemptOf(const Exercise& exercise, const Result& result, const std::string& trainee,
                  const std::string& date, const std::string& version, const std::string& directory);

/// Trainees by pseudonym and what they did, in an SQLite file that only its owner can read. Nothing else
/// about a person is kept. Several programs may use it at once: each waits for the others.
class Trainees {
 public:
  /// Opens the file, or makes it. @throws DatabaseError, also where it has other tables, views or triggers
  /// @param wait ms for other programs
  explicit Trainees(const std::string& file, int wait = 5000);
  ~Trainees();
  Trainees(const Trainees&) = delete;
  Trainees& operator=(const Trainees&) = delete;

  /// $VEST_TRAINEES, else trainees.db in the user's data folder (XDG_DATA_HOME, ~/.local/share)/vest, which
  /// is made.
  static std::string defaultFile();

  /// @throws DatabaseError where the pseudonym is taken, or is not 1 to 64 bytes of UTF-8 without controls
  /// and blanks at its ends, or has marks that turn the direction of writing
  void add(const std::string& pseudonym);
  std::vector<std::string> list() const;
  /// Keeps a result of a trainee who is known, and marks copies. @return the attempt as it was kept
  Attempt keep(Attempt attempt);
  /// Of a trainee, oldest first; of one exercise, or of all where it is empty.
  /// @throws DatabaseError where the JSON of an attempt at one exercise, which is compared, is none or has a
  /// key twice
  std::vector<Attempt> attempts(const std::string& trainee, const std::string& exercise = "") const;
  /// Everything that is kept of a trainee, JSON.
  std::string exported(const std::string& trainee) const;
  /// Forgets a trainee and all results; the bytes are overwritten.
  void erase(const std::string& trainee);

 private:
  void run(const char* sql) const;
  void checkBeside() const;  ///< what SQLite would wait for, or let the database grow by
  void checkTables() const;  ///< makes them where there are none
  void mustKnow(const std::string& trainee) const;
  [[noreturn]] void fail(const char* doing) const;

  std::string file_;
  sqlite3* database_ = nullptr;
};

}  // namespace vest::exercise
