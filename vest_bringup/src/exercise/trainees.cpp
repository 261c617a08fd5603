#include "vest_bringup/exercise/trainees.h"

#include <fcntl.h>
#include <linux/magic.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>

#include <sqlite3.h>
#include <nlohmann/json.hpp>

#include "vest_instruments/files/read.h"
#include "vest_instruments/files/strict_json.h"

namespace vest::exercise {

std::string dateNow() {
  const std::time_t now = std::time(nullptr);
  struct tm utc = {};
  gmtime_r(&now, &utc);
  char text[32] = "";
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &utc);
  return text;
}

namespace {

constexpr int kVersion = 1;  ///< of the tables

/// A prepared statement with its values bound.
class Statement {
 public:
  Statement(sqlite3* database, const char* sql, const std::vector<std::string>& values)
      : database_(database) {
    good_ = sqlite3_prepare_v2(database, sql, -1, &statement_, nullptr) == SQLITE_OK;
    for (std::size_t i = 0; good_ && i < values.size(); ++i)
      good_ = sqlite3_bind_text(statement_, static_cast<int>(i) + 1, values[i].data(),
                                static_cast<int>(values[i].size()), SQLITE_TRANSIENT) == SQLITE_OK;
  }
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  void number(int place, double value) {
    good_ = good_ && sqlite3_bind_double(statement_, place, value) == SQLITE_OK;
  }
  /// A row is there.
  bool row() {
    const int code = good_ ? sqlite3_step(statement_) : SQLITE_ERROR;
    good_ = code == SQLITE_ROW || code == SQLITE_DONE;
    return code == SQLITE_ROW;
  }
  bool good() const { return good_; }
  std::string text(int column) const {
    const auto* bytes = reinterpret_cast<const char*>(sqlite3_column_text(statement_, column));
    return bytes ? std::string(bytes, static_cast<std::size_t>(sqlite3_column_bytes(statement_, column)))
                 : "";
  }
  double real(int column) const { return sqlite3_column_double(statement_, column); }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
  bool good_ = false;
};

/// As SQLite keeps them. A database with other tables, or with views or triggers, is none of ours.
constexpr const char* kTrainee = "CREATE TABLE trainee(pseudonym TEXT PRIMARY KEY NOT NULL)";
constexpr const char* kAttempt =
    "CREATE TABLE attempt(id INTEGER PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(pseudonym) ON "
    "DELETE CASCADE, date TEXT, exercise TEXT, exercise_hash TEXT, input_hash TEXT, version TEXT, directory "
    "TEXT, flags TEXT, json TEXT, total REAL, quality REAL, time_s REAL, passed REAL)";
constexpr int kLongest = 16 << 20;  ///< bytes of a value

constexpr const char* kColumns =
    "trainee, date, exercise, exercise_hash, input_hash, version, directory, flags, json, total, quality, "
    "time_s, passed";

}  // namespace

Attempt attemptOf(const Exercise& e, const Result& r, const std::string& trainee, const std::string& date,
                  const std::string& version, const std::string& directory) {
  Attempt a;
  a.trainee = trainee, a.date = date, a.version = version, a.directory = directory;
  a.exercise = e.name, a.exercise_hash = e.hash;
  char hash[17];
  std::snprintf(hash, sizeof hash, "%016llx", static_cast<unsigned long long>(r.input_hash));
  a.input_hash = hash;
  a.total = r.total, a.quality = r.quality, a.time = r.time, a.passed = r.passed;
  for (const std::string& word : flagWords(r.flags)) a.flags += (a.flags.empty() ? "" : ",") + word;
  a.json = toJson(e, r);
  return a;
}

std::string Trainees::defaultFile() {
  const auto set = [](const char* name) {
    const char* const value = std::getenv(name);
    return std::string(value ? value : "");
  };
  if (!set("VEST_TRAINEES").empty()) return set("VEST_TRAINEES");
  std::string folder = set("XDG_DATA_HOME");
  if (folder.empty()) folder = set("HOME") + "/.local/share";
  folder += "/vest";
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  return folder + "/trainees.db";
}

void Trainees::fail(const char* doing) const {
  const int code = database_ ? sqlite3_errcode(database_) : SQLITE_CANTOPEN;
  std::string why = database_ ? sqlite3_errmsg(database_) : "cannot be opened";
  if (code == SQLITE_BUSY || code == SQLITE_LOCKED)
    why = "another program holds it (close that program, then try again)";
  if (code == SQLITE_FULL || code == SQLITE_IOERR)
    why = "the disk is full or failing (make room, then try again)";
  if (code == SQLITE_READONLY || code == SQLITE_CANTOPEN)
    why = "cannot be written (allowed: a file of yours in a folder of yours)";
  if (code == SQLITE_NOTADB || code == SQLITE_CORRUPT) why = "is no database of trainees, or damaged";
  throw DatabaseError(file_ + ": " + doing + ": " + why);
}

void Trainees::run(const char* sql) const {
  if (sqlite3_exec(database_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail("cannot be used");
}

Trainees::Trainees(const std::string& file, int wait) : file_(file) {
  // Made with its rights before anything is in it: SQLite's own files beside it take them over.
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) fail("open");
  struct stat info {};
  struct statfs where {};
  // Files of the kernel say that they are files; SQLite would wait in /proc/kmsg for its next line.
  const bool is_file = ::fstat(descriptor, &info) == 0 && S_ISREG(info.st_mode) &&
                       ::fstatfs(descriptor, &where) == 0 && where.f_type != PROC_SUPER_MAGIC;
  ::close(descriptor);
  if (!is_file) throw DatabaseError(file_ + ": is no file (allowed: a file of yours in a folder of yours)");
  checkBeside();
  try {
    if (sqlite3_open_v2(file.c_str(), &database_, SQLITE_OPEN_READWRITE, nullptr) != SQLITE_OK) fail("open");
    sqlite3_busy_timeout(database_, wait);
    sqlite3_limit(database_, SQLITE_LIMIT_LENGTH, kLongest);
    sqlite3_db_config(database_, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    run("PRAGMA trusted_schema=OFF; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL; PRAGMA "
        "secure_delete=ON; PRAGMA foreign_keys=ON");
    {  // A statement that is not at its end reads: who wrote meanwhile would be refused at once, not waited
       // for.
      Statement version(database_, "PRAGMA user_version", {});
      if (!version.row()) fail("read");
      const int found = static_cast<int>(version.real(0));
      if (found > kVersion)
        throw DatabaseError(file_ + ": its version is " + std::to_string(found) + " (allowed: at most " +
                            std::to_string(kVersion) + "; a newer VEST made it)");
    }
    run("BEGIN IMMEDIATE");
    checkTables();
    run("PRAGMA user_version=1; COMMIT");
  } catch (...) {
    sqlite3_close(database_);
    throw;
  }
}

void Trainees::checkBeside() const {
  constexpr std::uint32_t kMostPages = 1U << 14U;  // 64 MB of SQLite's usual pages (assumed)
  for (const char* const beside : {"-journal", "-wal", "-shm"}) {
    const std::string own = file_ + beside;
    struct stat info {};
    if (::lstat(own.c_str(), &info) == 0 && !S_ISREG(info.st_mode))
      throw DatabaseError(own + ": is no file (allowed: what SQLite leaves beside its database)");
  }
  // The header of a rollback journal (SQLite's file format, section 3): bytes 16 to 19 are pages, the highest
  // byte first.
  const std::string journal = file_ + "-journal";
  std::array<char, 20> head{};
  if (!std::ifstream(journal, std::ios::binary).read(head.data(), head.size())) return;
  std::uint32_t pages = 0;
  for (std::size_t i = 16; i < head.size(); ++i) pages = pages << 8U | static_cast<unsigned char>(head[i]);
  if (pages > kMostPages)
    throw DatabaseError(journal + ": pages: " + std::to_string(pages) + " (allowed: at most " +
                        std::to_string(kMostPages) + ": the database gets this size again)");
}

Trainees::~Trainees() {
  sqlite3_close(database_);
}

void Trainees::checkTables() const {
  int found = 0;
  {
    Statement tables(database_, "SELECT sql FROM sqlite_schema WHERE name NOT LIKE 'sqlite\\_%' ESCAPE '\\'",
                     {});
    while (tables.row()) {
      found += tables.text(0) == kTrainee || tables.text(0) == kAttempt ? 1 : 3;
      if (found > 2) throw DatabaseError(file_ + ": is no database of trainees: it has other tables");
    }
    if (!tables.good()) fail("read");
  }
  if (found == 1) throw DatabaseError(file_ + ": is no database of trainees: a table is missing");
  if (found == 0) run((std::string(kTrainee) + ";" + kAttempt).c_str());
}

void Trainees::add(const std::string& pseudonym) {
  if (pseudonym.empty() || pseudonym.size() > 64 || pseudonym.front() == ' ' || pseudonym.back() == ' ' ||
      files::shown(pseudonym, 64) != pseudonym)
    throw DatabaseError(
        "trainee: not a pseudonym (allowed: 1 to 64 bytes of UTF-8 without control characters, no blank at "
        "either end)");
  Statement insert(database_, "INSERT INTO trainee(pseudonym) VALUES(?1)", {pseudonym});
  insert.row();
  if (insert.good()) return;
  if (sqlite3_errcode(database_) == SQLITE_CONSTRAINT)
    throw DatabaseError("trainee '" + pseudonym + "': is there already (allowed: another pseudonym)");
  fail("add");
}

std::vector<std::string> Trainees::list() const {
  Statement select(database_, "SELECT pseudonym FROM trainee ORDER BY pseudonym", {});
  std::vector<std::string> names;
  while (select.row()) names.push_back(select.text(0));
  if (!select.good()) fail("read");
  return names;
}

void Trainees::mustKnow(const std::string& trainee) const {
  Statement select(database_, "SELECT 1 FROM trainee WHERE pseudonym=?1", {trainee});
  const bool known = select.row();
  if (!select.good()) fail("read");
  if (!known)
    throw DatabaseError("trainee '" + files::shown(trainee) +
                        "': unknown (vest_trainee add makes one, list tells all)");
}

Attempt Trainees::keep(Attempt a) {
  mustKnow(a.trainee);
  // Looked up and kept at once: of two that hand the same in together, one is the copy.
  if (sqlite3_exec(database_, "BEGIN IMMEDIATE", nullptr, nullptr, nullptr) != SQLITE_OK)
    fail("keep a result");
  try {
    {
      Statement same(database_, "SELECT 1 FROM attempt WHERE exercise=?1 AND input_hash=?2",
                     {a.exercise, a.input_hash});
      if (same.row()) a.flags += a.flags.empty() ? "copy" : ",copy";
      if (!same.good()) fail("read");
    }
    Statement insert(
        database_,
        "INSERT INTO attempt(trainee, date, exercise, exercise_hash, input_hash, version, directory, flags, "
        "json, total, quality, time_s, passed) VALUES(?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11,?12,?13)",
        {a.trainee, a.date, a.exercise, a.exercise_hash, a.input_hash, a.version, a.directory, a.flags,
         a.json});
    insert.number(10, a.total), insert.number(11, a.quality), insert.number(12, a.time);
    insert.number(13, a.passed ? 1 : 0);
    insert.row();
    if (!insert.good()) fail("keep a result");
    if (sqlite3_exec(database_, "COMMIT", nullptr, nullptr, nullptr) != SQLITE_OK) fail("keep a result");
  } catch (...) {
    sqlite3_exec(database_, "ROLLBACK", nullptr, nullptr, nullptr);
    throw;
  }
  return a;
}

std::vector<Attempt> Trainees::attempts(const std::string& trainee, const std::string& exercise) const {
  mustKnow(trainee);
  const std::string sql = std::string("SELECT ") + kColumns +
                          " FROM attempt WHERE trainee=?1 AND (?2='' OR exercise=?2) ORDER BY id";
  Statement select(database_, sql.c_str(), {trainee, exercise});
  std::vector<Attempt> all;
  while (select.row()) {
    all.push_back({select.text(0), select.text(1), select.text(2), select.text(3), select.text(4),
                   select.text(5), select.text(6), select.real(9), select.real(10), select.real(11),
                   select.real(12) != 0, select.text(7), select.text(8)});
    if (exercise.empty()) continue;
    try {
      files::parseJson(all.back().json);
    } catch (const files::Refused& why) {
      throw DatabaseError(file_ + ": attempt of " + files::shown(all.back().date) + ": json: " + why.what());
    }
  }
  if (!select.good()) fail("read");
  return all;
}

std::string Trainees::exported(const std::string& trainee) const {
  using nlohmann::json;
  json j;
  j["trainee"] = trainee;
  j["attempts"] = json::array();
  for (const Attempt& a : attempts(trainee)) {
    json result = a.json;  // what is no JSON is told as it stands: everything is
    try {
      result = files::parseJson(a.json);
    } catch (const files::Refused&) {
    }
    j["attempts"].push_back({{"date", a.date},
                             {"directory", a.directory},
                             {"version", a.version},
                             {"flags", a.flags},
                             {"result", std::move(result)}});
  }
  return j.dump(2, ' ', true, json::error_handler_t::replace) + "\n";
}

void Trainees::erase(const std::string& trainee) {
  mustKnow(trainee);
  Statement drop(database_, "DELETE FROM trainee WHERE pseudonym=?1", {trainee});
  drop.row();
  if (!drop.good()) fail("erase");
  // The journal has old pages still. Who reads in it at this moment keeps it.
  if (sqlite3_wal_checkpoint_v2(database_, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr) !=
      SQLITE_OK)
    throw DatabaseError(file_ + ": erased, but another program reads in " + file_ +
                        "-wal, which has the old bytes still (close that program, then vest_trainee list)");
}

}  // namespace vest::exercise
