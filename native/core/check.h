// CHECK for programmer errors: prints both values and aborts. DCHECK only with PHAROS_CHECKS.
// User input and misuse of the API are never CHECKed: they are reported or throw
// std::invalid_argument.
#pragma once

#include <cstdio>
#include <cstdlib>
#include <sstream>
#include <string>

namespace pharos::detail {

template <class A, class B>
[[noreturn]] void check_failed(const char* text, const A& a, const B& b, const char* where) {
    std::ostringstream out;
    out << "CHECK failed: " << text << " (" << a << " vs " << b << ") at " << where << '\n';
    std::fputs(out.str().c_str(), stderr);
    std::abort();
}

}  // namespace pharos::detail

#define PHAROS_STRING2(x) #x
#define PHAROS_STRING(x) PHAROS_STRING2(x)
#define PHAROS_CHECK_OP(a, op, b)                                                           \
    do {                                                                                    \
        const auto& check_a = (a);                                                          \
        const auto& check_b = (b);                                                          \
        if (!(check_a op check_b)) {                                                        \
            ::pharos::detail::check_failed(                                                 \
                #a " " #op " " #b, check_a, check_b, __FILE__ ":" PHAROS_STRING(__LINE__)); \
        }                                                                                   \
    } while (false)

#define CHECK_EQ(a, b) PHAROS_CHECK_OP(a, ==, b)
#define CHECK_NE(a, b) PHAROS_CHECK_OP(a, !=, b)
#define CHECK_LT(a, b) PHAROS_CHECK_OP(a, <, b)
#define CHECK_LE(a, b) PHAROS_CHECK_OP(a, <=, b)
#define CHECK_GT(a, b) PHAROS_CHECK_OP(a, >, b)
#define CHECK_GE(a, b) PHAROS_CHECK_OP(a, >=, b)
#define CHECK(a) PHAROS_CHECK_OP(static_cast<bool>(a), ==, true)

#ifdef PHAROS_CHECKS
#define DCHECK(a) CHECK(a)
#define DCHECK_LT(a, b) CHECK_LT(a, b)
#define DCHECK_LE(a, b) CHECK_LE(a, b)
#define DCHECK_GE(a, b) CHECK_GE(a, b)
#else
#define DCHECK(a) static_cast<void>(0)
#define DCHECK_LT(a, b) static_cast<void>(0)
#define DCHECK_LE(a, b) static_cast<void>(0)
#define DCHECK_GE(a, b) static_cast<void>(0)
#endif
