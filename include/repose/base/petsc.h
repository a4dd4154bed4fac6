#pragma once
#include <petscmat.h>
#include <petscvec.h>
#include <petscversion.h>
#include <utility>

#include "repose/base/error.h"

/// The one place for names that changed between the PETSc releases we stand on (3.18 … 3.22).
#if PETSC_VERSION_LT(3, 19, 0)
#define PETSC_SUCCESS 0
#endif

/// PETSc objects as owners, and PETSc's error codes as exceptions.
namespace repose::base {

/// A call of PETSc failed: an internal error, unless an option of the user's is the cause.
class PetscError : public InternalError {
 public:
  using InternalError::InternalError;
};

/// Where `code` is not zero, throws what run_callback() caught, or else PetscError with PETSc's own
/// text. Not collective.
void check(PetscErrorCode code);

/// Keeps the exception that is handled for the next check() of an error.
void keep_exception();

/// Returns the error code for PETSc of a function that it calls: no exception passes through C.
template <class Work>
PetscErrorCode run_callback(Work&& work) {
  try {
    work();
    return PETSC_SUCCESS;
  } catch (...) {
    keep_exception();
    return PETSC_ERR_USER;
  }
}

/// Checks the result of PETSc's …SetFromOptions, whose errors are the user's: throws InputError.
void check_options(PetscErrorCode code);

/// Owns one reference to a PETSc object; move-only. `Destroy` is the type's own destructor.
template <class Object, PetscErrorCode (*Destroy)(Object*)>
class Handle {
 public:
  Handle() = default;
  explicit Handle(Object object) : object_(object) {}  ///< takes over the reference
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    return *this;
  }
  ~Handle() {
    if (object_) Destroy(&object_);
  }
  operator Object() const { return object_; }
  Object* out() { return &object_; }  ///< for PETSc's creating functions; must be empty

 private:
  Object object_ = nullptr;
};

using VecHandle = Handle<Vec, VecDestroy>;
using MatHandle = Handle<Mat, MatDestroy>;
using ScatterHandle = Handle<VecScatter, VecScatterDestroy>;
using IndexSetHandle = Handle<IS, ISDestroy>;

/// Returns whether a PETSc object is of one of the types.
template <class Object, class... Types>
bool has_type(Object object, Types... types) {
  const auto is = [object](const char* type) {
    PetscBool same = PETSC_FALSE;
    check(PetscObjectTypeCompare(reinterpret_cast<PetscObject>(object), type, &same));
    return same == PETSC_TRUE;
  };
  return (is(types) || ...);
}

/// Returns the communicator of a PETSc object.
template <class Object>
MPI_Comm comm_of(Object object) {
  return PetscObjectComm(reinterpret_cast<PetscObject>(object));
}

/// PETSc and MPI for the life of a program: initializes both (root may run Open MPI), makes PETSc
/// return its errors instead of aborting, finalizes. Collective.
class Session {
 public:
  Session(int argc, char** argv);
  ~Session();
  Session(Session&&) = delete;
};

}  // namespace repose::base
