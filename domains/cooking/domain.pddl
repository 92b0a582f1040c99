; Vegetables are sliced on a board and put into a bowl by two grippers. Types, predicates and actions
; are named as in ProDG-v and mean the same. Two things there are worth knowing:
;   A container is no place: what is put into it is `in` it and `at` nowhere, and no action takes it
;   out again.
;   `in` is to be observed, but a labelled example must show something in a container for that.
(define (domain cooking)
  (:requirements :strips :typing :negative-preconditions)
  (:types
    movable location gripper - object
    veggie tool container - movable    ; what a gripper can carry
    cuttool - tool                     ; cuts
    workspace - location)              ; may be cut upon
  (:predicates
    (at ?o - movable ?l - location)    ; ?o stands or lies at ?l     observed
    (in ?o - movable ?c - container)   ; ?o is inside ?c             observed
    (carry ?g - gripper ?o - movable)  ; ?g holds ?o                 observed
    (is-sliced ?v - veggie)            ; ?v has been cut             observed
    (is-whole ?v - veggie)             ; ?v has not been cut         completed
    (available ?o - movable)           ; no gripper holds ?o         completed
    (free ?g - gripper))               ; ?g holds nothing            completed

  (:action pick
    :parameters (?g - gripper ?o - movable ?from - location)
    :precondition (and (free ?g) (available ?o) (at ?o ?from))
    :effect (and
      (carry ?g ?o)
      (not (free ?g)) (not (available ?o)) (not (at ?o ?from))))

  (:action place
    :parameters (?g - gripper ?o - movable ?to - location)
    :precondition (and (carry ?g ?o) (not (free ?g)) (not (at ?o ?to)))
    :effect (and
      (at ?o ?to) (available ?o) (free ?g)
      (not (carry ?g ?o))))

  (:action place_in
    :parameters (?g - gripper ?o - movable ?to - container)
    :precondition (and (carry ?g ?o) (not (free ?g)) (not (in ?o ?to)))
    :effect (and
      (in ?o ?to) (available ?o) (free ?g)
      (not (carry ?g ?o))))

  ; The gripper with the cutting tool cuts; the tool stays in it.
  (:action slice
    :parameters (?g - gripper ?v - veggie ?with - cuttool ?on - workspace)
    :precondition (and (carry ?g ?with) (at ?v ?on) (is-whole ?v) (not (is-sliced ?v)))
    :effect (and (is-sliced ?v) (not (is-whole ?v)))))
