; NAME: say here what the robot does. As it stands, the skeleton puts blocks on one another.
;
; Objects are told apart by the camera: a type is a way to look, and perception.toml says which. In the
; simulator a body has the type of its shape's name (block, disk, peg), or says its type (scenes/*.toml).
(define (domain NAME)
  (:requirements :strips :typing)
  (:types block arm-type - object)
  ; Each predicate has one source, which perception.toml names:
  ;   observed        judged from the image, by labelled examples; of one or two objects
  ;   proprioceptive  read off the gripper
  ;   completed       follows from the others, by a rule of completion.pddl
  (:predicates
    (on ?x - block ?y - block)      ; ?x stands on ?y            observed
    (on-table ?x - block)           ; ?x stands on the table     completed
    (clear ?x - block)              ; nothing stands on ?x       completed
    (holding ?x - block)            ; ?x is in the gripper       proprioceptive
    (empty-handed ?a - arm-type))   ; the gripper is empty       proprioceptive

  ; Each action has its skills in skills.toml. What a step changes must be seen or felt afterwards: the loop
  ; goes by what is there, not by what was promised.
  (:action take
    :parameters (?x - block ?a - arm-type)
    :precondition (and (clear ?x) (on-table ?x) (empty-handed ?a))
    :effect (and
      (holding ?x)
      (not (clear ?x)) (not (on-table ?x)) (not (empty-handed ?a))))

  (:action take-off
    :parameters (?x - block ?y - block ?a - arm-type)
    :precondition (and (on ?x ?y) (clear ?x) (empty-handed ?a))
    :effect (and
      (holding ?x) (clear ?y)
      (not (on ?x ?y)) (not (clear ?x)) (not (empty-handed ?a))))

  (:action put-on
    :parameters (?x - block ?y - block ?a - arm-type)
    :precondition (and (holding ?x) (clear ?y))
    :effect (and
      (on ?x ?y) (clear ?x) (empty-handed ?a)
      (not (holding ?x)) (not (clear ?y))))

  (:action put-down
    :parameters (?x - block ?a - arm-type)
    :precondition (holding ?x)
    :effect (and
      (on-table ?x) (clear ?x) (empty-handed ?a)
      (not (holding ?x)))))
