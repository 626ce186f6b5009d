// How the long sums of light are formed (passes.md "sums"). SUM1 and SUM3 hold a
// sum, ADD adds to it and TOTAL returns it; plain sums of floats are the numbers themselves. Needs
// GL_EXT_control_flow_attributes.

#define PLAIN 0
#define KAHAN 1
#define PAIRWISE 2
#ifndef SUMMATION
#define SUMMATION PLAIN
#endif
// 1: in double.
#ifndef DOUBLE
#define DOUBLE 0
#endif

#if DOUBLE
#define REAL double
#define REAL3 dvec3
#else
#define REAL float
#define REAL3 vec3
#endif

// Marks a loop that adds to sums. Compensated sums are not unrolled: spirv-opt's copies of an
// unrolled body lose `precise`, and then drivers take the compensation for 0.
#if SUMMATION == KAHAN
#define UNROLL [[dont_unroll]]
#else
#define UNROLL [[unroll]]
#endif

#if SUMMATION == PLAIN

#define SUM1 REAL
#define SUM3 REAL3
#define EMPTY1 REAL(0.0)
#define EMPTY3 REAL3(0.0)
#define ADD(sum, x) sum += x
#define TOTAL(sum) sum

#elif SUMMATION == KAHAN

// A sum, and what its roundings have lost. A term is added together with the loss, and Knuth's
// two-sum, exact whichever operand is greater, gives the new loss. It is `precise`, since a
// compiler that may transform sums takes every loss for 0.
struct SUM1 {
    REAL value;
    REAL lost;
};
struct SUM3 {
    REAL3 value;
    REAL3 lost;
};
#define EMPTY1 SUM1(REAL(0.0), REAL(0.0))
#define EMPTY3 SUM3(REAL3(0.0), REAL3(0.0))
#define ADD(sum, x) add_to(sum, x)
#define TOTAL(sum) sum.value
#define ADDING(SUM, T) \
    void add_to(inout SUM sum, T x) { \
        precise T term = x + sum.lost; \
        precise T value = sum.value + term; \
        precise T added = value - sum.value; \
        precise T lost = (sum.value - (value - added)) + (term - added); \
        sum = SUM(value, lost); \
    }
ADDING(SUM1, REAL)
ADDING(SUM3, REAL3)

#elif SUMMATION == PAIRWISE

// Terms are added up by blocks of BLOCK, and blocks as a binary counter counts. Part k is the sum
// of 2^k blocks; it holds a value where bit k of the number of blocks is set. The last part takes
// the rest. There is no loop and no index, so that parts can lie in registers.
const uint BLOCK = 8u;
const uint N_PARTS = 12u;
struct SUM1 {
    REAL block;
    uint n;
    REAL parts[N_PARTS];
};
struct SUM3 {
    REAL3 block;
    uint n;
    REAL3 parts[N_PARTS];
};
#define TWELVE(x) x, x, x, x, x, x, x, x, x, x, x, x
#define EMPTY1 SUM1(REAL(0.0), 0u, REAL[N_PARTS](TWELVE(REAL(0.0))))
#define EMPTY3 SUM3(REAL3(0.0), 0u, REAL3[N_PARTS](TWELVE(REAL3(0.0))))
#define ADD(sum, x) add_to(sum, x)
#define TOTAL(sum) total_of(sum)
#define ADDING(SUM, T) \
    void add_to(inout SUM sum, T x) { \
        sum.block += x; \
        sum.n += 1u; \
        if (sum.n % BLOCK == 0u) { \
            uint n_blocks = sum.n / BLOCK; \
            bool carries = true; \
            [[unroll]] for (uint k = 0u; k + 1u < N_PARTS; ++k) { \
                bool ends = carries && (n_blocks >> k & 1u) == 1u; \
                sum.block += carries && !ends ? sum.parts[k] : T(0.0); \
                sum.parts[k] = ends ? sum.block : sum.parts[k]; \
                carries = carries && !ends; \
            } \
            sum.parts[N_PARTS - 1u] += carries ? sum.block : T(0.0); \
            sum.block = T(0.0); \
        } \
    } \
    T total_of(SUM sum) { \
        uint n_blocks = sum.n / BLOCK; \
        T total = sum.block; \
        [[unroll]] for (uint k = 0u; k + 1u < N_PARTS; ++k) { \
            total += (n_blocks >> k & 1u) == 1u ? sum.parts[k] : T(0.0); \
        } \
        return total + sum.parts[N_PARTS - 1u]; \
    }
ADDING(SUM1, REAL)
ADDING(SUM3, REAL3)

#endif
