; Disks on pegs, moved one at a time. Predicates and `move` are named as in ProDG-v; `off-peg` and
; `recover` are added for what happens in a loop: a disk that ended up beside the pegs, perhaps on a
; disk of one, which is in the way there.
(define (domain hanoi)
  (:requirements :strips :typing :negative-preconditions :disjunctive-preconditions
                 :universal-preconditions :conditional-effects)
  (:types disk peg - object)
  (:predicates
    (on ?above - disk ?below - disk)   ; ?above lies directly on ?below       observed
    (on-peg ?d - disk ?p - peg)        ; ?p goes through ?d                   observed
    (smaller ?d1 - disk ?d2 - disk)    ; ?d1 may lie on ?d2                   observed
    (clear ?d - disk)                  ; nothing lies on ?d                   completed
    (off-peg ?d - disk))               ; no peg goes through ?d               completed

  ; Moves the top disk of one peg to another, where every disk must be larger.
  (:action move
    :parameters (?d - disk ?from - peg ?to - peg)
    :precondition (and
      (on-peg ?d ?from)
      (clear ?d)
      (not (on-peg ?d ?to))
      (forall (?d2 - disk) (or (not (on-peg ?d2 ?to)) (smaller ?d ?d2)))
      (forall (?d2 ?d3 - disk) (or (not (on-peg ?d2 ?to)) (not (on ?d3 ?d2)) (on-peg ?d3 ?to))))
    :effect (and
      (not (on-peg ?d ?from))
      (on-peg ?d ?to)
      (forall (?d2 - disk)
        (when (on ?d ?d2)
          (and (clear ?d2) (not (on ?d ?d2)))))
      (forall (?d2 - disk)
        (when (and (on-peg ?d2 ?to) (clear ?d2))
          (and (on ?d ?d2) (not (clear ?d2)))))))

  ; Puts a disk that lies beside the pegs back onto one.
  (:action recover
    :parameters (?d - disk ?to - peg)
    :precondition (and
      (off-peg ?d)
      (clear ?d)
      (forall (?d2 - disk) (or (not (on-peg ?d2 ?to)) (smaller ?d ?d2)))
      (forall (?d2 ?d3 - disk) (or (not (on-peg ?d2 ?to)) (not (on ?d3 ?d2)) (on-peg ?d3 ?to))))
    :effect (and
      (not (off-peg ?d))
      (on-peg ?d ?to)
      (forall (?d2 - disk)
        (when (on ?d ?d2)
          (and (clear ?d2) (not (on ?d ?d2)))))
      (forall (?d2 - disk)
        (when (and (on-peg ?d2 ?to) (clear ?d2))
          (and (on ?d ?d2) (not (clear ?d2))))))))
